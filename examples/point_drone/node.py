"""Process of the vehicle, with the topics of docs/functional-layer.md for a vehicle under Skillwing's guidance."""

from __future__ import annotations

import math
from typing import Any

from skillwing.onboard.topics import common, flight, navigation, sensors
from skillwing.services.bus import Bus, Request
from skillwing.services.bus.reading import message_reader
from skillwing.services.protocol import ErrorCode, ErrorReply, ProtocolError, decode, encode

from .vehicle import Mode, Vehicle

STEP = 0.02


class VehicleNode:
    """A publisher of the vehicle's state that takes setpoints. It uses the time of the robot."""

    name = "vehicle"
    owns_clock = False

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._vehicle = Vehicle(bus.now())
        self._told: flight.FlightState | None = None
        self._navigation = bus.advertise(navigation.NAVIGATION)
        self._flight = bus.advertise(flight.FLIGHT)
        self._battery = bus.advertise(flight.BATTERY)
        self._range = bus.advertise(sensors.RANGE)
        take = message_reader(flight.AutopilotSetpoint, lambda setpoint: self._vehicle.command(setpoint, bus.now()))
        bus.subscribe(flight.AUTOPILOT_SETPOINT, take, latest_only=True)
        bus.serve(flight.PILOT, self._hand_over)
        bus.every(STEP, self._advance)
        bus.every(0.05, self._tell_range)
        bus.every(0.1, self._tell_flight)
        bus.every(1.0, self._tell_battery)

    def detach(self) -> None:
        """Do nothing: the vehicle holds no resources."""

    def _advance(self) -> None:
        self._vehicle.advance(self._bus.now())
        if self._told is None or self._state(self._told.t) != self._told:
            self._tell_flight()
        self._tell_navigation()

    def _tell_navigation(self) -> None:
        vehicle = self._vehicle
        solution = navigation.Navigation(
            t=self._bus.now(),
            position=vehicle.position,
            velocity=vehicle.velocity,
            quaternion=(math.cos(vehicle.heading / 2.0), 0.0, 0.0, math.sin(vehicle.heading / 2.0)),
            angular_velocity=(0.0, 0.0, 0.0),
            heading=vehicle.heading,
        )
        self._navigation.put(encode(solution))

    def _tell_flight(self) -> None:
        self._told = self._state(self._bus.now())
        self._flight.put(encode(self._told))

    def _state(self, t: float) -> flight.FlightState:
        vehicle = self._vehicle
        return flight.FlightState(
            t=t,
            on_ground=vehicle.on_ground,
            rotors_on=not vehicle.on_ground,
            home_valid=True,
            authority=vehicle.authority,
            failsafe=vehicle.failsafe,
            follows=vehicle.mode is not Mode.BATTERY,
        )

    def _tell_range(self) -> None:
        self._range.put(encode(sensors.Range(t=self._bus.now(), distance=self._vehicle.position[2])))

    def _tell_battery(self) -> None:
        charge = self._vehicle.charge
        self._battery.put(encode(flight.Battery(t=self._bus.now(), percent=charge, voltage=21.0 + charge * 0.042)))

    def _hand_over(self, request: Request) -> None:
        """Answer the safety pilot's switch, which is on the remote control of a real vehicle."""
        try:
            wanted = decode(request.payload, flight.SetPilot)
        except ProtocolError as error:
            request.refuse(ErrorReply(code=ErrorCode.BAD_REQUEST, message=str(error), help="send a SetPilot"))
            return
        self._vehicle.authority = wanted.authority
        holder = "the computer" if wanted.authority else "the safety pilot"
        request.reply(encode(common.Done(text=f"{holder} has the authority")))


def make_vehicle(options: dict[str, Any]) -> VehicleNode:
    """The node; it takes no options."""
    if options:
        raise ValueError(f"the vehicle takes no options; remove {', '.join(sorted(options))}")
    return VehicleNode()
