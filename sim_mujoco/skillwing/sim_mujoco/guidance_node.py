"""Guidance as a process: commands and reports in, setpoints and status out."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from skillwing.services.bus import Bus, Publisher, Request, Sample
from skillwing.services.protocol import ErrorCode, ErrorReply, Message, ProtocolError, decode, encode

from . import topics
from .axis import RefusedError
from .guidance import GuidanceCore

M = TypeVar("M", bound=Message)
STATUS_PERIOD = 0.05


class GuidanceNode:
    """Shell around a `GuidanceCore`. It is clocked by navigation: without it there are no setpoints, and the
    autopilot's failsafe takes over."""

    name = "guidance"
    owns_clock = False

    def __init__(self, core: GuidanceCore) -> None:
        self._core = core
        self._bus: Bus | None = None
        self._setpoints: Publisher | None = None
        self._status: Publisher | None = None

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._setpoints = bus.advertise(topics.AUTOPILOT_SETPOINT)
        self._status = bus.advertise(topics.GUIDANCE_STATUS)
        core = self._core
        self._follow(topics.FLIGHT, topics.FlightState, core.flight)
        self._follow(topics.RANGE, topics.Range, lambda range_: core.range(range_.distance))
        self._follow(topics.OBSTACLE_STATUS, topics.ObstacleStatus, core.obstacles)
        self._follow(topics.NAVIGATION, topics.Navigation, self._on_navigation)
        bus.subscribe(
            topics.AUTHORITY, _reader(topics.Revoked, lambda revoked: core.revoke(revoked, bus.now())), events=True
        )
        bus.serve(topics.GUIDANCE_COMMAND, self._on_command)
        bus.every(STATUS_PERIOD, self._publish_status)

    def detach(self) -> None:
        """The autopilot notices by itself that setpoints have ended."""

    def _follow(self, key: str, kind: type[M], use: Callable[[M], object]) -> None:
        assert self._bus is not None
        self._bus.subscribe(key, _reader(kind, use), latest_only=True)

    def _on_navigation(self, navigation: topics.Navigation) -> None:
        self._core.navigation(navigation)
        setpoint = self._core.tick(navigation.t)
        if setpoint is not None and self._setpoints is not None:
            self._setpoints.put(encode(setpoint))

    def _on_command(self, request: Request) -> None:
        assert self._bus is not None
        try:
            text = self._core.command(decode(request.payload, topics.GuidanceCommand), self._bus.now())
        except ProtocolError as error:
            request.refuse(ErrorReply(code=ErrorCode.BAD_REQUEST, message=str(error), help="check the message"))
        except RefusedError as error:
            request.refuse(error.reply)
        else:
            request.reply(encode(topics.Done(text=text)))

    def _publish_status(self) -> None:
        if self._bus is not None and self._status is not None:
            self._status.put(encode(self._core.status(self._bus.now())))


def _reader(kind: type[M], use: Callable[[M], object]) -> Callable[[Sample], None]:
    """A subscriber that passes on what it can read; what it cannot read counts as not sent."""

    def read(sample: Sample) -> None:
        try:
            message = decode(sample.payload, kind)
        except ProtocolError:
            return
        use(message)

    return read
