"""Attribution of requests: the name that the router guarantees takes the place of the one that the sender gives."""

from __future__ import annotations

import re
from typing import TypeVar

import msgspec

from skillwing.services.core.refusal import RefusedError
from skillwing.services.names import CLIENT, SEPARATOR, skill_process
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    EndGoal,
    ErrorCode,
    FireEvent,
    FireExtern,
    InterruptGoal,
    Message,
    ModifyGoal,
    Record,
    RecordOutcome,
    RenewGoal,
    StartGoal,
    StartMission,
)

M = TypeVar("M", bound=Message)
_WORD = re.compile(r"[A-Za-z0-9_-]{1,40}")


def attributed(request: M, asker: str | None) -> M:
    """A request with the name of its asker, as the router knows it (`named`); unchanged without a name.

    Raises RefusedError (DENIED) for an owner that belongs to somebody else, and for a call of a skill manager in the
    name of another one.
    """
    if asker is None:
        return request
    match request:
        case StartGoal():
            _require_own_owner(request, asker)
            return msgspec.structs.replace(request, client=named(asker, request.client))
        case InterruptGoal() | ModifyGoal() | StartMission():
            return msgspec.structs.replace(request, client=named(asker, request.client))
        case FireExtern() | FireEvent():
            return msgspec.structs.replace(request, source=named(asker, request.source))
        case AttachManager() | BeginGoal() | RecordOutcome():
            _require_own_process(request.manager, asker)
        case _:
            pass
    match request:
        case BeginGoal() | EndGoal() | RecordOutcome() | RenewGoal():
            _require_own_process(skill_process(request.skill), asker)
        case _:
            pass
    return request


def named(asker: str, given: str) -> str:
    """The true name of an asker, with what a person's program calls itself: `alice (mission)`.

    The part in brackets is the sender's word. A process has its name alone.
    """
    return f"{asker} ({given})" if "." not in asker and given != asker and _WORD.fullmatch(given) else asker


def vouched(record: Record, writer: str) -> Record | None:
    """A timeline record with a true source; None for one with an id that is not its writer's.

    A process may write ids of its own form. Those of a person begin with the name, so that no record takes the place of
    a manager's.
    """
    process = writer.partition(".")[2]
    if process:
        return record if record.source.replace("/", ".") == process else _of(record, writer)
    if not record.id.startswith(f"{writer}{SEPARATOR}"):
        return None
    return record if record.source.startswith(f"{writer}{SEPARATOR}") else _of(record, writer)


def _of(record: Record, source: str) -> Record:
    return msgspec.structs.replace(record, source=source)


def _require_own_owner(request: StartGoal, asker: str) -> None:
    if request.owner is None:
        return
    own = f"{CLIENT}{asker}"
    if request.owner != own and not request.owner.startswith(f"{own}{SEPARATOR}"):
        raise RefusedError(
            ErrorCode.DENIED,
            f"`{asker}` gives `{request.owner}` as the owner of a goal, which belongs to somebody else.",
            help=f"Give `{own}` or no owner.",
        )


def _require_own_process(process: str, asker: str) -> None:
    """Raise for a process other than the asker's. A process's name in the robot follows the first dot of its name."""
    if asker.partition(".")[2] != process.replace("/", "."):
        raise RefusedError(
            ErrorCode.DENIED,
            f"`{asker}` asks in the name of `{process}`.",
            help="A manager asks for its own skill only.",
        )
