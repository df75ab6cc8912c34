"""The airframe: a 14 kg hexacopter on two skids, as a MuJoCo body and as the numbers its controller needs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.physics.rotor_faults import ROTORS

BODY = "m600"
ARM = 0.5665
"""Distance of the rotors from the centre [m]."""
TORQUE_PER_THRUST = 0.025
"""Reaction torque of a rotor per newton of thrust [m]."""
MIN_THRUST, MAX_THRUST = 4.0, 50.0
"""Limits of a turning rotor [N]."""
ROTOR_LAG = 0.05
"""Time constant of thrust [s]."""
ROTOR_RADIUS = 0.27
"""Half the diameter of the M600's propellers, 21 inches; `extent.TIP_RADIUS` includes their tips [m]."""
GEAR_HEIGHT = 0.565
"""Height of the centre above the ground when the drone stands on its skids [m]."""

_SPIN = (1, -1, 1, -1, 1, -1)
_ANGLES = tuple(math.radians(30 + 60 * rotor) for rotor in range(ROTORS))
_SKID = GEAR_HEIGHT - 0.015
_ROTOR_HEIGHT = 0.06
_BLADE_HALF = 0.01
"""Half the height of the disc of a turning blade [m]."""


@dataclass(frozen=True, slots=True)
class Airframe:
    """Mass [kg], diagonal inertia [kg m2], and the allocation (4, 6): thrust and torque (x, y, z) for each newton of a
    rotor."""

    mass: float
    inertia: Vector
    allocation: NDArray[np.float64]


def attach_to(spec: mujoco.MjSpec, position: Vector, name: str = BODY) -> None:
    """Put a drone into a world specification, its centre at `position`, and set up air and time step.

    name: of this drone in the model, before a slash.
    """
    spec.option.timestep = 0.002
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.density, spec.option.viscosity = 1.2, 1.8e-5
    drone = mujoco.MjSpec.from_string(_mjcf())
    frame = spec.worldbody.add_frame(pos=list(position))
    frame.attach_body(drone.body("body"), f"{name}/", "")


def airframe(model: mujoco.MjModel, name: str = BODY) -> Airframe:
    """Read mass and inertia back from the compiled model, so that controller and physics agree."""
    body = model.body(f"{name}/body").id
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, model.body_iquat[body])
    rotation = rotation.reshape(3, 3)
    x, y, z = np.diag(rotation @ np.diag(model.body_inertia[body]) @ rotation.T)
    angles, spin = np.array(_ANGLES), np.array(_SPIN)
    allocation = np.vstack([np.ones(ROTORS), ARM * np.sin(angles), -ARM * np.cos(angles), -TORQUE_PER_THRUST * spin])
    return Airframe(float(model.body_mass[body]), (float(x), float(y), float(z)), allocation)


def _mjcf() -> str:
    """Body of the drone as MJCF. The discs that the blades sweep are massless parts of it, for collisions."""
    arms, discs, rotors = "", "", ""
    for i, (angle, spin) in enumerate(zip(_ANGLES, _SPIN, strict=True)):
        x, y = ARM * math.cos(angle), ARM * math.sin(angle)
        arms += f"""
          <geom name="arm{i}" type="capsule" fromto="0 0 0 {x:.5f} {y:.5f} 0.02" size="0.02" mass="0.15"/>
          <geom name="motor{i}" type="cylinder" pos="{x:.5f} {y:.5f} 0.03" size="0.03 0.03" mass="0.25"/>
          <site name="rotor{i}" pos="{x:.5f} {y:.5f} {_ROTOR_HEIGHT}"/>"""
        discs += f"""
          <geom name="disc{i}" type="cylinder" pos="{x:.5f} {y:.5f} {_ROTOR_HEIGHT}"
                size="{ROTOR_RADIUS} {_BLADE_HALF}" mass="0"/>"""
        rotors += f"""
        <general name="rotor{i}" site="rotor{i}" gear="0 0 1 0 0 {-spin * TORQUE_PER_THRUST}"
                 ctrlrange="0 {MAX_THRUST}" dyntype="filterexact" dynprm="{ROTOR_LAG}"/>"""
    skids = "".join(
        f'<geom name="skid-{side}" type="capsule" fromto="-0.4 {y} {-_SKID} 0.4 {y} {-_SKID}" size="0.015" mass="0.6"/>'
        for side, y in (("left", 0.4), ("right", -0.4))
    )
    return f"""
    <mujoco>
      <compiler autolimits="true"/>
      <worldbody>
        <body name="body">
          <freejoint name="root"/>
          <geom name="hub" type="ellipsoid" size="0.25 0.25 0.12" mass="10.4"
                fluidshape="ellipsoid" fluidcoef="0.5 0.25 1.5 1.0 1.0"/>
          {skids}{arms}{discs}
          <site name="imu"/>
        </body>
      </worldbody>
      <actuator>{rotors}</actuator>
      <sensor><accelerometer name="accelerometer" site="imu"/><gyro name="gyro" site="imu"/></sensor>
    </mujoco>"""
