"""What an operator may ask of a running mission, as queries on the bus."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeAlias

from skillwing.services.bus import Bus, Handle, Request
from skillwing.services.protocol import (
    AbortMission,
    ErrorCode,
    ErrorReply,
    Keys,
    MissionStatus,
    PauseMission,
    ProtocolError,
    ResumeMission,
    decode,
    encode,
)

Obey: TypeAlias = Callable[[str], str | None]


class OperatedMission(Protocol):
    """Whom the orders are for. Each returns a sentence that says what is against it, None where it is obeyed."""

    @property
    def status(self) -> MissionStatus: ...
    def abort(self, reason: str) -> str | None: ...
    def pause(self, reason: str) -> str | None: ...
    def resume(self, reason: str) -> str | None: ...


def serve_operator_requests(bus: Bus, keys: Keys, mission: OperatedMission) -> list[Handle]:
    """Answer each order with what the mission says of itself afterwards, or with a refusal."""

    def serve(key: str, kind: type[AbortMission | PauseMission | ResumeMission], follow: Obey) -> Handle:
        def on_request(request: Request) -> None:
            try:
                order = decode(request.payload, kind)
            except ProtocolError as error:
                help_ = f"Send the message `{kind.__name__}`."
                request.refuse(ErrorReply(code=ErrorCode.BAD_REQUEST, message=f"{error}.", help=help_))
                return
            refusal = follow(order.reason)
            if refusal is None:
                request.reply(encode(mission.status))
            else:
                help_ = "`skillwing mission watch` shows what it does."
                request.refuse(ErrorReply(code=ErrorCode.NOT_ALLOWED, message=refusal, help=help_))

        return bus.serve(key, on_request)

    return [
        serve(keys.mission_abort, AbortMission, mission.abort),
        serve(keys.mission_pause, PauseMission, mission.pause),
        serve(keys.mission_resume, ResumeMission, mission.resume),
    ]
