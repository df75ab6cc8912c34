"""`run.json`: what was run, for whoever reports it, or looks at it later."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from skillwing.dsl import SkillsetError, load
from skillwing.dsl.model import Skillset
from skillwing.services.errors import InvalidOptionError
from skillwing.services.robot import UnknownRobotError, find_robot

RUN_FILE = "run.json"


class RunFacts(msgspec.Struct, frozen=True, kw_only=True):
    """robot: its name. skillset: the path of its file. schema: the version of it that was run, None where that is not
    known. judge: of its flights, as `Robot.judge` names it. options: of
    the run (`seed`, `world`, ...). mission: the only one of this run, whose report stands in the run directory itself;
    None where missions come and go."""

    robot: str
    skillset: str
    schema: str | None = None
    judge: str | None = None
    options: dict[str, Any] = {}
    mission: str | None = None


def write_facts(run_dir: Path, facts: RunFacts) -> None:
    """Write them down, with the version that the skillset has now; raises OSError."""
    with suppress(SkillsetError, OSError):  # whoever runs it says so
        facts = msgspec.structs.replace(facts, schema=load(Path(facts.skillset)).schema_hash)
    run_dir.mkdir(parents=True, exist_ok=True)
    (run_dir / RUN_FILE).write_bytes(msgspec.json.format(msgspec.json.encode(facts), indent=2) + b"\n")


def lacking(run: Path, file: str) -> InvalidOptionError:
    """What to tell who named a run in which there is no such file, or where there is nothing at all."""
    if not run.exists():
        text = f"There is no folder `{run}`. Name the directory of a run; they are in `runs/`, unless said otherwise."
    else:
        text = f"`{run}` holds no `{file}`. Name the directory of a run that was recorded."
    return InvalidOptionError("RUN", text)


def read_facts(run_dir: Path) -> RunFacts:
    """What was run there, with the skillset's file as it is here; raises InvalidOptionError if nobody has written it
    down."""
    try:
        return _here(msgspec.json.decode((run_dir / RUN_FILE).read_bytes(), type=RunFacts))
    except FileNotFoundError as error:
        raise lacking(run_dir, RUN_FILE) from error
    except msgspec.DecodeError as error:
        raise InvalidOptionError("RUN", f"`{run_dir / RUN_FILE}` cannot be read: {error}.") from error


def _here(facts: RunFacts) -> RunFacts:
    """A run that comes from another machine, or out of a container, names a file that was there: this machine's robot
    of that name has it, too."""
    if Path(facts.skillset).exists():
        return facts
    try:
        return msgspec.structs.replace(facts, skillset=str(find_robot(facts.robot).skillset))
    except UnknownRobotError:
        return facts


def other_version(facts: RunFacts, skillset: Skillset) -> str | None:
    """What to tell who reads a run by another version of its skillset than was run; None if it is the same, or nobody
    has written down which it was."""
    if facts.schema in (None, skillset.schema_hash):
        return None
    return (
        f"Version {facts.schema} of `{skillset.name}` was run; `{facts.skillset}` is version {skillset.schema_hash}, "
        "by which this is told. Why goals were refused, and what resources there are, may have been otherwise."
    )
