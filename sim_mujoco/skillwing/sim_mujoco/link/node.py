"""The radio link as a process: it carries video down and reports up, and publishes its status."""

from __future__ import annotations

from collections import deque
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from skillwing.onboard.commands.service import CommandRefusedError, answer_with
from skillwing.onboard.topics import link, video
from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.faults import LINK_FAULT, SetLinkFault, fault_id
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus import Bus, Publisher, Sample
from skillwing.services.bus.reading import message_reader
from skillwing.services.options import OptionsError, read_options
from skillwing.services.protocol import ErrorCode, encode
from skillwing.sim_mujoco.link.packet_queue import Packet, PacketQueue
from skillwing.sim_mujoco.link.radio import Conditions, Radio, occlusion_zones
from skillwing.sim_mujoco.scenario.format import RadioOptions, RadioZone
from skillwing.sim_mujoco.scenario.reading import ScenarioError, read_scenario
from skillwing.sim_mujoco.sensors.faults import MagnitudeError, UnknownFaultError
from skillwing.sim_mujoco.world.kinds import SiteOptions

STEP = 0.01
"""Period of the queues while packets are under way [s]."""
STATUS_PERIOD, BUSY_STATUS_PERIOD = 1.0, 0.2
_AVERAGED = 1.0
"""Time over which the sent data rate is averaged [s]."""


class LinkNode:
    """Shell around a `Radio` and a `PacketQueue` for each direction. At rest it only publishes a status each second.

    The drone's position comes from the truth: the radio is part of the world, not of the robot.
    """

    name = "link"
    owns_clock = False

    def __init__(self, radio: Radio, seed: int) -> None:
        self._radio = radio
        self._down = PacketQueue(np.random.default_rng((seed, 2000)))
        self._up = PacketQueue(np.random.default_rng((seed, 2001)))
        self._position: Vector3 = (0.0, 0.0, 0.0)
        self._sent: deque[tuple[float, int]] = deque()
        self._moving = False
        self._told_at = 0.0
        self._bus: Bus | None = None

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._ends = (
            (self._down, bus.advertise(video.VIDEO_RECEIVED)),
            (self._up, bus.advertise(video.VIDEO_STATUS)),
        )
        self._status = bus.advertise(link.LINK_STATUS)
        bus.subscribe(TRUTH, message_reader(Truth, self._on_truth), latest_only=True)
        bus.subscribe(video.VIDEO_SENT, lambda sample: self._carry(self._down, sample))
        bus.subscribe(video.VIDEO_REPORT, lambda sample: self._carry(self._up, sample))
        bus.serve(LINK_FAULT, answer_with(SetLinkFault, self._set_fault))
        bus.every(STATUS_PERIOD, self._publish_status)

    def detach(self) -> None:
        """Lose all packets under way, as a modem does that is switched off."""

    def _on_truth(self, truth: Truth) -> None:
        self._position = truth.position

    def _set_fault(self, wanted: SetLinkFault) -> str:
        assert self._bus is not None
        try:
            self._radio.switch(self._bus.now(), wanted.kind, wanted.on, wanted.magnitude)
        except UnknownFaultError as error:
            raise CommandRefusedError(ErrorCode.UNKNOWN_NAME, str(error), "choose a known kind", error.known) from error
        except MagnitudeError as error:
            raise CommandRefusedError(ErrorCode.BAD_REQUEST, str(error), error.advice) from error
        self._publish_status()
        return f"{wanted.kind} of the link is {'on' if wanted.on else 'off'}"

    # --- packets ---------------------------------------------------------------------------------------------

    def _carry(self, queue: PacketQueue, sample: Sample) -> None:
        assert self._bus is not None
        if not self._moving:
            # The queues have to serve the time at rest too, or it would count as time of sending.
            self._moving = True
            now = self._bus.now()
            for each, _ in self._ends:
                each.serve(now, self.conditions)
            self._bus.after(STEP, self._move)
        queue.put(self._bus.now(), Packet(sample.payload, sample.attachment))

    def _move(self) -> None:
        assert self._bus is not None
        now, conditions = self._bus.now(), self.conditions
        before = self._down.sent
        for queue, end in self._ends:
            _deliver(end, queue.serve(now, conditions))
        if self._down.sent > before:
            self._sent.append((now, self._down.sent - before))
        self._moving = not (self._down.idle and self._up.idle)
        if self._moving:
            self._bus.after(STEP, self._move)
        if now - self._told_at >= BUSY_STATUS_PERIOD:
            self._publish_status()

    @property
    def conditions(self) -> Conditions:
        """Bandwidth, latency and loss now."""
        return self._radio.at(0.0 if self._bus is None else self._bus.now(), self._position)

    # --- status ----------------------------------------------------------------------------------------------

    def _publish_status(self) -> None:
        assert self._bus is not None
        now, conditions = self._bus.now(), self.conditions
        self._told_at = now
        while self._sent and self._sent[0][0] <= now - _AVERAGED:
            self._sent.popleft()
        faults = self._radio.faults(now)
        status = link.LinkStatus(
            t=now,
            bandwidth=conditions.bandwidth,
            latency=conditions.latency,
            loss=conditions.loss,
            queued=8.0 * self._down.held / max(conditions.bandwidth, 1.0),
            sent=8.0 * sum(size for _, size in self._sent) / _AVERAGED,
            dropped=self._down.dropped,
            faults=faults,
            fault=fault_id("link", faults[0], self._radio.fault_since(faults[0])) if faults else None,
        )
        self._status.put(encode(status))


def _deliver(end: Publisher, packets: list[Packet]) -> None:
    for packet in packets:
        end.put(packet.payload, packet.attachment)


class LinkOptions(RadioOptions, frozen=True, forbid_unknown_fields=True, rename={"occlusion": "shadow"}):
    """Options of `make_link`: those of the radio, and the seed of its losses.

    scenario: a file whose section `link` adds zones and faults, and replaces other options. shadow: the building of the
    `site` occludes the link as well.
    """

    seed: int = 1
    scenario: str | None = None
    site: SiteOptions | None = None
    occlusion: bool = False


def make_link(options: dict[str, Any]) -> LinkNode:
    """The link. Raises OptionsError."""
    wanted = read_options(options, LinkOptions)
    radio: RadioOptions = wanted
    if wanted.scenario is not None:
        try:
            section = read_scenario(Path(wanted.scenario)).link
        except ScenarioError as error:
            raise OptionsError(str(error)) from error
        if section is not None:
            zones, faults = section.zones + wanted.zones, section.faults + wanted.faults
            radio = msgspec.structs.replace(section, zones=zones, faults=faults)
    if wanted.occlusion:
        radio = msgspec.structs.replace(radio, zones=(*radio.zones, *_occlusion(wanted.site or SiteOptions())))
    return LinkNode(Radio(radio), wanted.seed)


def _occlusion(chosen: SiteOptions) -> tuple[RadioZone, ...]:
    target = chosen.site().target
    if target is None:
        raise OptionsError(f"a world of kind `{chosen.kind}` has no building to occlude the link; `inspection` has one")
    return occlusion_zones(target)
