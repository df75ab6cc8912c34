"""One drone under MuJoCo: its true motion, contacts and inertial measurements."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.extent import TIP_RADIUS
from skillwing.onboard.frames.vectors import Motion, Quaternion, Vector, norm
from skillwing.sim_mujoco.physics.dynamics import Dynamics
from skillwing.sim_mujoco.physics.hexacopter import Airframe, airframe
from skillwing.sim_mujoco.physics.rotor_faults import ROTORS
from skillwing.sim_mujoco.world.world import World

_HARD_LANDING = 1.5
"""Speed of the skids at touchdown above which it counts as a collision [m/s]."""
_SEPARATE = 1.0
"""Time between contacts below which they are one collision [s]."""


class Physics:
    """One drone of a world, advanced in steps of `dt` seconds. The same inputs give the same motion, bit by bit.

    dynamics: shared by all drones of the world; by default one for this drone alone. number: of this drone in it.
    """

    dt = Dynamics.dt

    def __init__(self, world: World, dynamics: Dynamics | None = None, number: int = 0) -> None:
        self._dynamics = dynamics or Dynamics(world, (world.home,))
        self.number = number
        self._name = self._dynamics.drones[number]
        self._model, self._data = self._dynamics.model, self._dynamics.data
        self._find_state()
        self._scenery = frozenset(np.flatnonzero(self._model.geom_bodyid == 0).tolist())
        self._ground = {geom for geom in self._scenery if self._model.geom(geom).name.startswith("terrain")}
        self._skids = {self._geom("skid-left"), self._geom("skid-right")}
        self._own = frozenset(np.flatnonzero(self._model.geom_bodyid == self._body).tolist())
        self._twist = np.zeros(6)
        self._last_contact = -_SEPARATE
        self._shares: NDArray[np.float64] | None = None
        self.collisions = 0
        self._previous: list[float] = self._data.sensordata[self._sensors].tolist()
        """Accelerometer and gyroscope one step ago."""

    def _find_state(self) -> None:
        """Note where the state of this drone lies in that of all. Slices stay right in a copy, views do not."""
        model = self._model
        self._body = model.body(f"{self._name}/body").id
        places = [int(model.jnt_qposadr[model.joint(f"{name}/root").id]) for name in self._dynamics.drones]
        q, v = places.pop(self.number), int(model.jnt_dofadr[model.joint(f"{self._name}/root").id])
        self._q, self._v = slice(q, q + 7), slice(v, v + 6)
        self._elsewhere = [slice(place, place + 7) for place in places]
        rotor = model.actuator(f"{self._name}/rotor0").id
        self._rotors = slice(rotor, rotor + ROTORS)
        lag = int(model.actuator_actadr[rotor])
        self._act = slice(lag, lag + ROTORS)
        sensor = int(model.sensor(f"{self._name}/accelerometer").adr[0])
        self._sensors = slice(sensor, sensor + 6)

    @property
    def dynamics(self) -> Dynamics:
        return self._dynamics

    @property
    def airframe(self) -> Airframe:
        return airframe(self._model, self._name)

    @property
    def motion(self) -> Motion:
        q, v = self._data.qpos[self._q].tolist(), self._data.qvel[self._v].tolist()
        return Motion(
            self._data.time, (q[0], q[1], q[2]), (v[0], v[1], v[2]), (q[3], q[4], q[5], q[6]), (v[3], v[4], v[5])
        )

    @property
    def thrust(self) -> float:
        """Total thrust of the rotors now [N]."""
        return sum(self._data.act[self._act].tolist())

    @property
    def inertial(self) -> tuple[float, ...]:
        """Specific force (3) [m/s2] and angular rate (3) [rad/s] in FLU, the mean over the last two steps.

        A real IMU integrates between its samples. Skids at rest oscillate by micrometres with a period of a few steps;
        every other step alone would turn that into a constant 0.06 m/s2, half a degree of tilt.
        """
        now = self._data.sensordata[self._sensors].tolist()
        return tuple([0.5 * (one + other) for one, other in zip(self._previous, now, strict=True)])

    def others(self) -> list[tuple[Vector, Quaternion]]:
        """Position and attitude of each other drone of the world now."""
        states = [self._data.qpos[place].tolist() for place in self._elsewhere]
        return [((q[0], q[1], q[2]), (q[3], q[4], q[5], q[6])) for q in states]

    @property
    def separation(self) -> float | None:
        """Distance between the spheres round this and the nearest other drone [m]; None for a lone drone."""
        here = self.motion.position
        centres = [math.dist(here, there) for there, _ in self.others()]
        return min(centres) - 2.0 * TIP_RADIUS if centres else None

    def set_wind(self, wind: Vector) -> None:
        """Set the wind from now on, in the world frame [m/s]."""
        self._dynamics.set_wind(self.number, wind)

    def set_rotors(self, shares: list[float]) -> None:
        """Set the share of the commanded thrust that each rotor (6) gives from now on."""
        self._shares = np.array(shares) if min(shares) < 1.0 else None

    def place(self, position: Vector, heading: float = 0.0) -> None:
        """Put the drone somewhere, hovering: for tests of control. Time goes on."""
        data = self._data
        data.qpos[self._q] = [*position, np.cos(heading / 2), 0.0, 0.0, np.sin(heading / 2)]
        data.qvel[self._v] = data.qacc_warmstart[self._v] = 0.0
        data.act[self._act] = self.airframe.mass * 9.81 / ROTORS
        data.ctrl[self._rotors] = 0.0
        mujoco.mj_forward(self._model, data)
        self._previous = data.sensordata[self._sensors].tolist()

    def step(self, thrusts: list[float]) -> None:
        """Advance a lone drone by `dt` with these commanded rotor thrusts (6) [N]."""
        self.actuate(thrusts)
        self._dynamics.step()
        self.check_contacts()

    def actuate(self, thrusts: list[float]) -> None:
        """Command the rotor thrusts (6) of the next step [N]."""
        self._data.ctrl[self._rotors] = thrusts
        if self._shares is not None:
            self._data.ctrl[self._rotors] *= self._shares
        self._previous = self._data.sensordata[self._sensors].tolist()

    def check_contacts(self) -> None:
        """Count a collision after a step, unless all contacts are skids that touch the ground gently."""
        if not self._data.ncon:
            return
        now, pairs = self._data.time, self._data.contact.geom.tolist()
        mine = [number for number, (one, other) in enumerate(pairs) if one in self._own or other in self._own]
        if not mine:
            return
        if not all(self._is_footing(*pairs[number]) for number in mine) or self._comes_down_hard(mine):
            if now - self._last_contact > _SEPARATE:
                self.collisions += 1
            self._last_contact = now

    def _is_footing(self, one: int, other: int) -> bool:
        fixed, moving = (one, other) if one in self._scenery else (other, one)
        return fixed in self._ground and moving in self._skids

    def _comes_down_hard(self, contacts: list[int]) -> bool:
        """The drone was too fast at a contact, or a skid hit the ground too fast.

        MuJoCo finds contacts before it advances the motion. After the step it still has the velocity from before, which
        the contact had not reduced yet. A skid may slide faster than the drone moves.
        """
        data = self._data
        mujoco.mj_objectVelocity(self._model, data, mujoco.mjtObj.mjOBJ_XBODY, self._body, self._twist, 0)
        p, q, r, x, y, z = self._twist.tolist()
        speed = norm((x, y, z))
        if speed + TIP_RADIUS * norm((p, q, r)) <= _HARD_LANDING:
            return False  # no point of the drone is faster, and a standing drone is checked at every step
        arms = data.contact.pos[contacts] - data.xpos[self._body]
        points = np.cross(self._twist[:3], arms) + self._twist[3:]
        sunk = np.abs((points * data.contact.frame[contacts, :3]).sum(axis=1))
        return bool(max(speed, sunk.max()) > _HARD_LANDING)

    def _geom(self, name: str) -> int:
        return self._model.geom(f"{self._name}/{name}").id
