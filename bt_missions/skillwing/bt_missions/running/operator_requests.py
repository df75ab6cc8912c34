"""Requests of an operator to a running mission, served as queries on the bus."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeAlias

from skillwing.services.bus import Handle, Network, Request
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

Handler: TypeAlias = Callable[[str], str | None]


class OperatedMission(Protocol):
    """The mission that the requests are for. Each handler returns None, or a sentence with which it refuses."""

    @property
    def status(self) -> MissionStatus: ...
    def abort(self, reason: str) -> str | None: ...
    def pause(self, reason: str) -> str | None: ...
    def resume(self, reason: str) -> str | None: ...


def serve_operator_requests(bus: Network, keys: Keys, mission: OperatedMission) -> list[Handle]:
    """Reply to each request with the status after it, or with a refusal."""

    def serve(key: str, kind: type[AbortMission | PauseMission | ResumeMission], handler: Handler) -> Handle:
        def on_request(request: Request) -> None:
            try:
                message = decode(request.payload, kind)
            except ProtocolError as error:
                help_ = f"Send the message `{kind.__name__}`."
                request.refuse(ErrorReply(code=ErrorCode.BAD_REQUEST, message=f"{error}.", help=help_))
                return
            # With keys the router guarantees the name of the sender.
            by = "" if request.asker is None else f" ({request.asker})"
            refusal = handler(f"{message.reason}{by}")
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
