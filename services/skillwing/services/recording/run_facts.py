"""`run.json`: facts of a run, for its reports and pictures."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from skillwing.dsl import SkillsetError, load
from skillwing.dsl.model import Skillset
from skillwing.dsl.whole_files import write_whole
from skillwing.services.errors import InvalidOptionError
from skillwing.services.robot import UnknownRobotError, find_robot

RUN_FILE = "run.json"


class RunFacts(msgspec.Struct, frozen=True, kw_only=True):
    """Facts of a run. robot: its name. skillset: path of its file. schema: its version, None if unknown.

    begun: Unix time of the latest begin that was recorded; None for runs of earlier versions. judge: as in
    `Robot.judge`. options: of the run (`seed`, `world`, ...). mission: the only mission of this run, with its report in
    the run directory itself; None for a system to which missions come and go.
    """

    robot: str
    skillset: str
    schema: str | None = None
    begun: float | None = None
    judge: str | None = None
    options: dict[str, Any] = {}
    mission: str | None = None


def write_facts(run_dir: Path, facts: RunFacts, *, goes_on: bool = False) -> None:
    """Write the facts with the skillset's present version, and the present time as the begin; raises OSError.

    goes_on: a run that is in the directory already keeps its begin.
    """
    begun = _known_begin(run_dir) if goes_on else None
    facts = msgspec.structs.replace(facts, begun=begun or time.time())
    with suppress(SkillsetError, OSError):  # the processes of the run report it
        facts = msgspec.structs.replace(facts, schema=load(Path(facts.skillset)).schema_hash)
    run_dir.mkdir(parents=True, exist_ok=True)
    write_whole(run_dir / RUN_FILE, msgspec.json.format(msgspec.json.encode(facts), indent=2) + b"\n")


def _known_begin(run_dir: Path) -> float | None:
    with suppress(InvalidOptionError, OSError):
        return read_facts(run_dir).begun
    return None


def missing_run_file(run: Path, file: str) -> InvalidOptionError:
    """The error for a run without such a file, or without a directory."""
    if not run.exists():
        text = f"There is no folder `{run}`. Name the directory of a run; by default they are in `runs/`."
    else:
        text = f"`{run}` holds no `{file}`. Name the directory of a run that was recorded."
    return InvalidOptionError("RUN", text)


def read_facts(run_dir: Path) -> RunFacts:
    """The facts of a run, with the skillset's file of this machine; raises InvalidOptionError for a run without
    them."""
    try:
        return _here(msgspec.json.decode((run_dir / RUN_FILE).read_bytes(), type=RunFacts))
    except FileNotFoundError as error:
        raise missing_run_file(run_dir, RUN_FILE) from error
    except msgspec.DecodeError as error:
        raise InvalidOptionError("RUN", f"`{run_dir / RUN_FILE}` cannot be read: {error}.") from error


def _here(facts: RunFacts) -> RunFacts:
    """The facts with a skillset file that exists here. A run from another machine or a container names a file of that
    machine; the robot of that name has it here, too."""
    if Path(facts.skillset).exists():
        return facts
    try:
        return msgspec.structs.replace(facts, skillset=str(find_robot(facts.robot).skillset))
    except UnknownRobotError:
        return facts


def version_note(facts: RunFacts, skillset: Skillset) -> str | None:
    """A note for a run that is read with another version of its skillset; None for the same or an unknown version."""
    if facts.schema in (None, skillset.schema_hash):
        return None
    return (
        f"Version {facts.schema} of `{skillset.name}` was run; `{facts.skillset}` is version {skillset.schema_hash}. "
        "Resources, and reasons for which goals were refused, may have been different."
    )
