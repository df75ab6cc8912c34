"""The radio link to the ground."""

from __future__ import annotations

from typing import Annotated

import msgspec

from skillwing.onboard.topics.faults import FASTEST_LINK
from skillwing.services.protocol import Label, Message, Time

LINK_STATUS = "fl/link/status"  # LinkStatus, 1 Hz; 5 Hz while packets cross the link


class LinkStatus(Message, frozen=True, kw_only=True):
    """State of the modem on board.

    `bandwidth` [bit/s] is that of its present modulation; `latency` [s] and `loss` are those of the channel. `queued`
    is the time that its queue takes to send [s], and `sent` what it sent in the last second [bit/s]. `dropped` counts
    the packets that found its queue full since it was switched on. `faults` are the simulated ones."""

    t: Time
    bandwidth: Annotated[float, msgspec.Meta(ge=0.0, le=1e6 * FASTEST_LINK)]
    latency: Annotated[float, msgspec.Meta(ge=0.0)]
    loss: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
    queued: Annotated[float, msgspec.Meta(ge=0.0)]
    sent: Annotated[float, msgspec.Meta(ge=0.0)]
    dropped: Annotated[int, msgspec.Meta(ge=0)]
    faults: tuple[Label, ...] = ()
