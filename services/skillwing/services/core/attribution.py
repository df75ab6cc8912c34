"""Attribution of requests: the name that the router guarantees takes the place of the one that the sender gives."""

from __future__ import annotations

from typing import TypeVar

import msgspec

from skillwing.services.core.refusal import RefusedError
from skillwing.services.names import CLIENT, skill_process
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
    RecordOutcome,
    RenewGoal,
    StartGoal,
)

M = TypeVar("M", bound=Message)


def attributed(request: M, asker: str | None) -> M:
    """A request with the name of its asker, as the router knows it; unchanged without a name.

    Raises RefusedError (DENIED) for an owner that belongs to somebody else, and for a call of a skill manager in the
    name of another one.
    """
    if asker is None:
        return request
    match request:
        case StartGoal():
            _require_own_owner(request, asker)
            return msgspec.structs.replace(request, client=asker)
        case InterruptGoal() | ModifyGoal():
            return msgspec.structs.replace(request, client=asker)
        case FireExtern() | FireEvent():
            return msgspec.structs.replace(request, source=asker)
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


def _require_own_owner(request: StartGoal, asker: str) -> None:
    if request.owner is None:
        return
    own = f"{CLIENT}{asker}"
    if request.owner != own and not request.owner.startswith(f"{own}~"):
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
