"""Tree files in texts, for tests."""

from __future__ import annotations

from pathlib import Path

from fake_interface import SKILLSET

from skillwing.bt_missions.checking.mission_check import check_mission
from skillwing.bt_missions.xml.document import TreeFileError, parse_document
from skillwing.bt_missions.xml.mission import XmlMission
from skillwing.bt_missions.xml.tree_file import tree_file
from skillwing.dsl.model import Skillset

FILE = Path("mission.xml")
RESCUE = '<BehaviorTree ID="rescue"><AlwaysSuccess/></BehaviorTree>'


def mission_of(text: str) -> XmlMission:
    return XmlMission(tree_file(parse_document(text.encode(), FILE), FILE))


def with_tree(tree: str, more: str = "") -> str:
    """A file whose tree `main` stands alone in the second line."""
    main = f'<BehaviorTree ID="main">\n{tree}\n</BehaviorTree>'
    return f'<root BTCPP_format="4" main_tree_to_execute="main">{main}\n{RESCUE}{more}</root>'


def problems_of(text: str, skillset: Skillset = SKILLSET) -> list[str]:
    """Every problem as `line: text`."""
    try:
        loaded = mission_of(text)
        problems = check_mission(loaded, skillset, loaded.Options())
    except TreeFileError as error:
        problems = error.problems
    return [str(problem).removeprefix(f"{FILE}:") for problem in problems]
