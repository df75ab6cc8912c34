"""The drone in its world under MuJoCo: true motion, contacts and inertial measurements."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.extent import TIP_RADIUS
from skillwing.onboard.frames.vectors import Motion, Vector, norm
from skillwing.sim_mujoco.physics.hexacopter import BODY, GEAR_HEIGHT, Airframe, airframe, attach_to
from skillwing.sim_mujoco.world.world import World

_HARD_LANDING = 1.5
"""Speed of the skids at touchdown above which it counts as a collision [m/s]."""
_SEPARATE = 1.0
"""Time between contacts below which they are one collision [s]."""


class Physics:
    """One drone in one world, advanced in steps of `dt` seconds. The same inputs give the same motion, bit by bit."""

    dt = 0.002

    def __init__(self, world: World) -> None:
        spec = world.spec()
        attach_to(spec, (*world.home, GEAR_HEIGHT + 0.005))
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._scenery = frozenset(np.flatnonzero(self._model.geom_bodyid == 0).tolist())
        self._ground = {geom for geom in self._scenery if self._model.geom(geom).name.startswith("terrain")}
        self._skids = {self._geom("skid-left"), self._geom("skid-right")}
        self._body = self._model.body(f"{BODY}/body").id
        self._twist = np.zeros(6)
        self._last_contact = -_SEPARATE
        self._shares: NDArray[np.float64] | None = None
        self.collisions = 0
        mujoco.mj_forward(self._model, self._data)
        self._previous: list[float] = self._data.sensordata.tolist()
        """Accelerometer and gyroscope one step ago."""

    @property
    def airframe(self) -> Airframe:
        return airframe(self._model)

    @property
    def motion(self) -> Motion:
        q, v = self._data.qpos.tolist(), self._data.qvel.tolist()
        return Motion(
            self._data.time, (q[0], q[1], q[2]), (v[0], v[1], v[2]), (q[3], q[4], q[5], q[6]), (v[3], v[4], v[5])
        )

    @property
    def thrust(self) -> float:
        """Total thrust of the rotors now [N]."""
        return sum(self._data.act.tolist())

    @property
    def inertial(self) -> tuple[float, ...]:
        """Specific force (3) [m/s2] and angular rate (3) [rad/s] in FLU, the mean over the last two steps.

        A real IMU integrates between its samples. Skids at rest oscillate by micrometres with a period of a few steps;
        every other step alone would turn that into a constant 0.06 m/s2, half a degree of tilt.
        """
        now = self._data.sensordata.tolist()
        return tuple([0.5 * (one + other) for one, other in zip(self._previous, now, strict=True)])

    def set_wind(self, wind: Vector) -> None:
        """Set the wind from now on, in the world frame [m/s]."""
        self._model.opt.wind[:] = wind

    def set_rotors(self, shares: list[float]) -> None:
        """Set the share of the commanded thrust that each rotor (6) gives from now on."""
        self._shares = np.array(shares) if min(shares) < 1.0 else None

    def place(self, position: Vector, heading: float = 0.0) -> None:
        """Put the drone somewhere, hovering: for tests of control. Time goes on."""
        now = self._data.time
        mujoco.mj_resetData(self._model, self._data)
        self._data.time = now
        self._data.qpos[:] = [*position, np.cos(heading / 2), 0.0, 0.0, np.sin(heading / 2)]
        self._data.act[:] = self.airframe.mass * 9.81 / len(self._data.act)
        mujoco.mj_forward(self._model, self._data)
        self._previous = self._data.sensordata.tolist()

    def step(self, thrusts: list[float]) -> None:
        """Advance by `dt` with these commanded rotor thrusts (6) [N]."""
        self._data.ctrl[:] = thrusts
        if self._shares is not None:
            self._data.ctrl *= self._shares
        self._previous = self._data.sensordata.tolist()
        mujoco.mj_step(self._model, self._data)
        if self._data.ncon:
            self._check_contacts()

    def _check_contacts(self) -> None:
        """Count a collision, unless all contacts are skids that touch the ground gently."""
        now = self._data.time
        pairs = self._data.contact.geom.tolist()
        if not all(self._is_footing(one, other) for one, other in pairs) or self._comes_down_hard():
            if now - self._last_contact > _SEPARATE:
                self.collisions += 1
            self._last_contact = now

    def _is_footing(self, one: int, other: int) -> bool:
        fixed, moving = (one, other) if one in self._scenery else (other, one)
        return fixed in self._ground and moving in self._skids

    def _comes_down_hard(self) -> bool:
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
        points = np.cross(self._twist[:3], data.contact.pos - data.xpos[self._body]) + self._twist[3:]
        sunk = np.abs((points * data.contact.frame[:, :3]).sum(axis=1))
        return bool(max(speed, sunk.max()) > _HARD_LANDING)

    def _geom(self, name: str) -> int:
        return self._model.geom(f"{BODY}/{name}").id
