"""Checks of the tree skills that a mission starts."""

from __future__ import annotations

from pathlib import Path

from skillwing.bt_missions.checking.mission_check import offline_context
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionOptions
from skillwing.bt_missions.mission.problems import FaultyMissionError, MissionProblem
from skillwing.bt_missions.tree_skill.checks import BODY_SUFFIXES, body_problems, call_paths, called_skills, read_body
from skillwing.dsl.model import Skillset


def skills_folder(skillset: Path) -> Path:
    """The folder with the managers of a robot's package, and the trees of its skills. It may not exist.

    skillset: its file in the package, or the copy in `generated/`.
    """
    package = skillset.parent.parent if skillset.parent.name == "generated" else skillset.parent
    return package / "skills"


def called_skill_problems(
    mission: Mission, skillset: Skillset, options: MissionOptions, folder: Path | None
) -> list[MissionProblem]:
    """All problems of the trees of skills that a mission starts, directly or through such trees.

    folder: of these trees; None if it is not known. The result is empty for a mission that cannot be built, which
    `check_mission` reports.
    """
    if folder is None:
        return []
    try:
        trees, _ = mission.draft(offline_context(skillset), options)
        leaves = [leaf for tree in trees.all for leaf in tree.iterate() if isinstance(leaf, SkillAction)]
    except (Exception, SystemExit):  # noqa: BLE001 - code of users may raise anything
        return []
    calls: dict[str, frozenset[str]] = {}
    found: list[MissionProblem] = []
    for *_, skill in call_paths((leaf.skill for leaf in leaves), calls):
        files = [file for suffix in BODY_SUFFIXES if (file := folder / f"{skill}{suffix}").is_file()]
        if not files:
            continue
        try:
            source = read_body(files[0], skillset)
        except FaultyMissionError as error:
            found += error.problems
            continue
        found += [problem.in_file(source.file) for problem in body_problems(source, skillset, skill, folder)]
        calls[skill] = called_skills(source, skillset)
    return found
