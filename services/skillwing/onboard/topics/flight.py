"""The vehicle's flight state and battery, its autopilot's setpoints, and its safety pilot."""

from __future__ import annotations

from skillwing.onboard.topics.common import Done, Sentence, Vector2, Vector3
from skillwing.onboard.topics.processes import BRIDGE, GUIDANCE, OPERATOR, RECORDER, SKILLS, VEHICLE
from skillwing.onboard.topics.rows import query, stream
from skillwing.services.protocol import Message, Time
from skillwing.services.wire.channel import Channel, Duty

FLIGHT = "fl/flight"
BATTERY = "fl/battery"
AUTOPILOT_SETPOINT = "fl/autopilot/setpoint"
PILOT = "fl/pilot"


class FlightState(Message, frozen=True, kw_only=True):
    """`authority`: the safety pilot lets this computer fly. `failsafe`: what the autopilot does by itself, or "".

    `follows`: the autopilot follows setpoints; False while it overrules them, however fresh. `holds_heading`: the
    heading can be controlled; False after the loss of a rotor. `home`: the vehicle's home point (ENU, m), the origin
    unless several vehicles share a world.
    """

    t: Time
    on_ground: bool
    rotors_on: bool
    home_valid: bool
    authority: bool
    failsafe: Sentence = ""
    follows: bool = True
    holds_heading: bool = True
    home: Vector2 = (0.0, 0.0)


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


IN_THE_AIR = "in the air and during a takeoff, at the rate of navigation"
TOPICS: tuple[Channel, ...] = (
    stream(FLIGHT, FlightState, VEHICLE, (GUIDANCE, BRIDGE, SKILLS), Duty.MUST, rate=10.0, when="and at each change"),
    stream(AUTOPILOT_SETPOINT, AutopilotSetpoint, GUIDANCE, (VEHICLE,), Duty.MUST, rate=50.0, when=IN_THE_AIR),
    stream(BATTERY, Battery, VEHICLE, (BRIDGE, RECORDER), Duty.SHOULD, rate=1.0),
    query(PILOT, SetPilot, Done, VEHICLE, (OPERATOR,), Duty.TRIALS),
)
