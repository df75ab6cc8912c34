"""The vehicle's flight state and battery, its autopilot's setpoints, and its safety pilot."""

from __future__ import annotations

from skillwing.onboard.topics.common import Sentence, Vector3
from skillwing.services.protocol import Message, Time

FLIGHT = "fl/flight"  # FlightState, 10 Hz and at each change
BATTERY = "fl/battery"  # Battery, 1 Hz
AUTOPILOT_SETPOINT = "fl/autopilot/setpoint"  # AutopilotSetpoint, 50 Hz, guidance -> autopilot
PILOT = "fl/pilot"  # query SetPilot -> Done


class FlightState(Message, frozen=True, kw_only=True):
    """`authority`: the safety pilot lets this computer fly. `failsafe`: what the autopilot does by itself, or "".

    `follows`: the autopilot follows setpoints; False while it overrules them, however fresh. `holds_heading`: the
    heading can be controlled; False after the loss of a rotor.
    """

    t: Time
    on_ground: bool
    rotors_on: bool
    home_valid: bool
    authority: bool
    failsafe: Sentence = ""
    follows: bool = True
    holds_heading: bool = True


class Battery(Message, frozen=True, kw_only=True):
    t: Time
    percent: float
    voltage: float


class AutopilotSetpoint(Message, frozen=True, kw_only=True):
    """Position at `t` (ENU), velocity and acceleration to feed forward, and heading.

    `rotors` False lets the rotors stop on the ground. Guidance never sends it: the autopilot detects the touchdown."""

    t: Time
    position: Vector3
    velocity: Vector3
    heading: float
    rotors: bool
    acceleration: Vector3 = (0.0, 0.0, 0.0)


class SetPilot(Message, frozen=True, kw_only=True):
    """The safety pilot takes authority (False) or gives it to the computer (True)."""

    authority: bool
