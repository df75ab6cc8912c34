"""Observer of a campaign's flight: it reads the ground truth and detects the end of the flight."""

from __future__ import annotations

import hashlib
import math

import numpy as np

from skillwing.evaluation.flights.cost import CostMeter
from skillwing.evaluation.flights.result import End
from skillwing.evaluation.flights.saved_map import SavedMap
from skillwing.onboard.frames.extent import TIP_RADIUS
from skillwing.onboard.topics.common import Empty, Vector2
from skillwing.onboard.topics.flight import FLIGHT, FlightState
from skillwing.onboard.topics.mapping import MAP_SNAPSHOT, MAPPING_STATUS, MapHeader, MappingStatus
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus import Answer, Answered, Bus
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.protocol import GoalStatus, Keys, MissionStatus, Record, decode, encode
from skillwing.sim_mujoco.world.terrain import Terrain

AT_HOME = 2.0
"""Largest horizontal distance from the home point for a landing at home [m]."""
AT_REST = 0.1
"""Highest speed of a drone at rest [m/s]."""
HELD_FOR = 5.0
"""Time that a drone under the pilot's authority has to hold its position, after the mission's end [s]."""
HELD_WITHIN = 2.0
"""Largest distance from that position [m]."""


class FlightObserver:
    """Node that receives the ground truth, which the robot does not know.

    terrain: of the world. pilot_returns: the safety pilot returns the authority, so that no flight ends as handed over.
    meter: sums the costs of the flight.
    """

    name = "witness"
    owns_clock = False

    def __init__(
        self, skillset: str, terrain: Terrain, *, pilot_returns: bool = False, meter: CostMeter | None = None
    ) -> None:
        self._keys = Keys(skillset)
        self._terrain = terrain
        self.meter = meter or CostMeter()
        self._pilot_returns = pilot_returns
        self._digest = hashlib.sha256()
        self._state: FlightState | None = None
        self._truth: Truth | None = None
        self._held: Truth | None = None
        self._outside = False
        self._pose_source = ""
        self.mission: MissionStatus | None = None
        self.failsafes: list[str] = []
        self.breaches = 0
        self.clearance: float | None = None
        self.separation: float | None = None
        """Least distance to another drone so far, tip to tip [m]; None for a drone that is alone."""
        self.map: SavedMap | None = None

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        keys = self._keys
        bus.subscribe(TRUTH, message_reader(Truth, self._on_truth))
        bus.subscribe(FLIGHT, message_reader(FlightState, self._on_state))
        bus.subscribe(MAPPING_STATUS, message_reader(MappingStatus, self._on_mapping))
        bus.subscribe(keys.mission_status, message_reader(MissionStatus, self._on_mission), events=True)
        follow_records(bus, keys, self._on_message, self._on_message)
        self.meter.attach(bus)

    def detach(self) -> None:
        """Do nothing: the observer holds no resources."""

    # --- results ----------------------------------------------------------------------------------------------------

    @property
    def over(self) -> bool:
        """True if the mission is over, and the drone stands or holds its position under the pilot's authority."""
        return self._mission_over and self.end is not End.FLYING

    @property
    def _mission_over(self) -> bool:
        return self.mission is not None and self.mission.phase.over

    @property
    def end(self) -> End:
        """End of the flight so far. `HANDED_OVER` counts only after the mission's end."""
        state, truth = self._state, self._truth
        if state is None or truth is None:
            return End.FLYING
        if state.on_ground and not state.rotors_on:
            return self._landed(truth, state.home)
        held = self._held
        handed_over = held is not None and not self._pilot_returns and truth.t - held.t >= HELD_FOR
        return End.HANDED_OVER if handed_over else End.FLYING

    def _landed(self, truth: Truth, home: Vector2) -> End:
        """True end of a flight whose landing the autopilot reports."""
        x, y, z = truth.position
        if math.hypot(*truth.velocity) > AT_REST:
            return End.FLYING
        if z - self._terrain.height(x, y) > TIP_RADIUS:
            return End.NOT_LANDED  # too high to touch the ground, even when toppled
        return End.HOME if math.dist((x, y), home) <= AT_HOME else End.ELSEWHERE

    @property
    def collisions(self) -> int:
        return 0 if self._truth is None else self._truth.collisions

    @property
    def digest(self) -> str:
        """Digest of all timeline records and changes of goals so far, in the order of their arrival."""
        return self._digest.hexdigest()

    def ask_for_map(self) -> None:
        """Request the map. `map` holds it after the answer."""
        self._bus.ask(MAP_SNAPSHOT, encode(Empty()), self._on_snapshot)

    # --- input ------------------------------------------------------------------------------------------------------

    def _on_truth(self, truth: Truth) -> None:
        self._truth = truth
        if not truth.inside_fence and not self._outside:
            self.breaches += 1
        self._outside = not truth.inside_fence
        self.clearance = truth.clearance if self.clearance is None else min(self.clearance, truth.clearance)
        if truth.separation is not None:
            self.separation = min(truth.separation, truth.separation if self.separation is None else self.separation)
        held_by_pilot = self._state is not None and not self._state.authority
        if not (held_by_pilot and self._mission_over):
            self._held = None
        elif self._held is None or math.dist(self._held.position, truth.position) > HELD_WITHIN:
            self._held = truth

    def _on_state(self, state: FlightState) -> None:
        self._state = state
        if state.failsafe and state.failsafe not in self.failsafes:
            self.failsafes.append(state.failsafe)

    def _on_mission(self, status: MissionStatus) -> None:
        self.mission = status

    def _on_mapping(self, status: MappingStatus) -> None:
        self._pose_source = status.pose_source

    def _on_snapshot(self, answer: Answer) -> None:
        if isinstance(answer, Answered):
            header = decode(answer.attachment, MapHeader)
            centres = np.frombuffer(answer.payload, np.float32).reshape(-1, 3)
            self.map = SavedMap(centres, header.voxel_size, self._pose_source)

    def _on_message(self, message: Record | GoalStatus) -> None:
        self._digest.update(encode(message))
