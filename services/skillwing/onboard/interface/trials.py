"""What only simulated robots have: faults by command, the truth, a safety pilot at a keyboard."""

from __future__ import annotations

from skillwing.onboard.interface.topic import LINK, RECORDER, VEHICLE, Duty, Kind, Topic
from skillwing.onboard.topics import common, faults, flight, truth
from skillwing.services.protocol import ErrorCode

TRYING = (
    Topic(
        truth.TRUTH,
        Kind.STREAM,
        truth.Truth,
        Duty.TRIALS,
        VEHICLE,
        (LINK, RECORDER, "campaigns"),
        "Where the vehicle really is, and how near to what. For judges, recordings and the simulated radio; never for "
        "the robot.",
        "No judgement of a flight, no path in its recording.",
        rate=20.0,
    ),
    Topic(
        flight.PILOT,
        Kind.QUERY,
        flight.SetPilot,
        Duty.TRIALS,
        VEHICLE,
        ("`skillwing pilot`",),
        "The safety pilot takes the authority, or gives it back. A real one does so on the remote control, and the "
        "vehicle tells it in its flight state.",
        "`skillwing pilot` says that there is no simulated drone.",
        reply=common.Done,
    ),
    Topic(
        faults.FAULT,
        Kind.QUERY,
        faults.SetFault,
        Duty.TRIALS,
        VEHICLE,
        ("`skillwing fault`",),
        "Make a sensor or a rotor fail, or work again.",
        "`skillwing fault` says that there is no simulated drone.",
        reply=common.Done,
        refusals=(ErrorCode.UNKNOWN_NAME,),
    ),
    Topic(
        faults.FAULTS,
        Kind.QUERY,
        common.Empty,
        Duty.TRIALS,
        VEHICLE,
        ("`skillwing fault --list`",),
        "What can fail, and what does.",
        "`skillwing fault --list` says that there is no simulated drone.",
        reply=faults.Faults,
    ),
    Topic(
        faults.LINK_FAULT,
        Kind.QUERY,
        faults.SetLinkFault,
        Duty.TRIALS,
        LINK,
        ("`skillwing fault link`",),
        "Make the radio link narrow, or cut it.",
        "`skillwing fault link` says that nobody answers.",
        reply=common.Done,
        refusals=(ErrorCode.UNKNOWN_NAME,),
    ),
)
