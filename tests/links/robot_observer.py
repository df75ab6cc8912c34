"""Observer of a flight, in the robot's own namespace: a line of JSON for each change of what counts.

python tests/links/robot_observer.py
"""

from __future__ import annotations

import math
import sys

import msgspec

from skillwing.onboard.topics.flight import FLIGHT, FlightState
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.connection import Connection, find_target, open_connection
from skillwing.services.protocol import GoalStatus, MissionPhase, MissionStatus, State

CLIMBING, CRUISING = 1.5, 4.0
"""Height, and distance to the east, from which a flight is at take-off and in cruise [m]."""


class Seen(msgspec.Struct, frozen=True):
    """The flight so far. up, away: above, and away from the place of take-off. running: skills with a running goal.

    mission: phase and text of the latest status, without one of a mission that has not begun.
    """

    up: bool = False
    away: bool = False
    stands: bool = False
    running: tuple[str, ...] = ()
    collisions: int = 0
    left_fence: bool = False
    from_home: int = 0
    over: bool = False
    succeeded: bool = False
    mission: str = ""


class Observer:
    """Follows the flight on a connection, and prints what it sees."""

    def __init__(self, connection: Connection) -> None:
        self._seen = Seen()
        bus, keys = connection.bus, connection.keys
        bus.subscribe(TRUTH, message_reader(Truth, self._on_truth), latest_only=True)
        bus.subscribe(FLIGHT, message_reader(FlightState, self._on_state), latest_only=True)
        bus.subscribe(keys.status("*"), message_reader(GoalStatus, self._on_goal), events=True)
        bus.subscribe(keys.mission_status, message_reader(MissionStatus, self._on_mission), events=True)
        self._print()

    def _on_truth(self, truth: Truth) -> None:
        east, north, up = truth.position
        self._change(
            up=up > CLIMBING,
            away=east > CRUISING,
            collisions=truth.collisions,
            left_fence=self._seen.left_fence or not truth.inside_fence,
            from_home=round(math.hypot(east, north)),
        )

    def _on_state(self, state: FlightState) -> None:
        self._change(stands=state.on_ground and not state.rotors_on)

    def _on_goal(self, status: GoalStatus) -> None:
        running = set(self._seen.running)
        (running.add if status.state is State.RUNNING else running.discard)(status.skill)
        self._change(running=tuple(sorted(running)))

    def _on_mission(self, status: MissionStatus) -> None:
        text = f"{status.phase}: {status.text}" if status.text else str(status.phase)
        self._change(mission=text, over=status.phase.over, succeeded=status.phase is MissionPhase.SUCCEEDED)

    def _change(self, **fields: object) -> None:
        before, self._seen = self._seen, msgspec.structs.replace(self._seen, **fields)
        if self._seen != before:
            self._print()

    def _print(self) -> None:
        sys.stdout.write(f"{msgspec.json.encode(self._seen).decode()}\n")
        sys.stdout.flush()


def main() -> None:
    """Observe until the process is ended."""
    with open_connection(find_target(), client="observer") as connection:
        Observer(connection)
        connection.bus.run_until(lambda: False)


if __name__ == "__main__":
    main()
