"""The radio link to the ground."""

from __future__ import annotations

from typing import Annotated

import msgspec

from skillwing.onboard.topics.faults import FASTEST_LINK
from skillwing.onboard.topics.processes import BRIDGE, LINK, RECORDER, SKILLS, VIDEO
from skillwing.onboard.topics.rows import stream
from skillwing.services.protocol import Label, Message, Time
from skillwing.services.wire.channel import Channel, Duty

LINK_STATUS = "fl/link/status"


class LinkStatus(Message, frozen=True, kw_only=True):
    """State of the modem on board.

    `bandwidth` [bit/s] is that of its present modulation; `latency` [s] and `loss` are those of the channel. `queued`
    is the time that its queue takes to send [s], and `sent` what it sent in the last second [bit/s]. `dropped` counts
    the packets that found its queue full since it was switched on. `faults` are the simulated ones, and `fault` is the
    timeline record of the first of them."""

    t: Time
    bandwidth: Annotated[float, msgspec.Meta(ge=0.0, le=1e6 * FASTEST_LINK)]
    latency: Annotated[float, msgspec.Meta(ge=0.0)]
    loss: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
    queued: Annotated[float, msgspec.Meta(ge=0.0)]
    sent: Annotated[float, msgspec.Meta(ge=0.0)]
    dropped: Annotated[int, msgspec.Meta(ge=0)]
    faults: tuple[Label, ...] = ()
    fault: Label | None = None


TOPICS: tuple[Channel, ...] = (
    stream(
        LINK_STATUS,
        LinkStatus,
        LINK,
        (VIDEO, SKILLS, BRIDGE, RECORDER),
        Duty.SOME,
        when="1 Hz; 5 Hz while something crosses the link",
    ),
)
