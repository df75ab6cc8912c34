"""Loops are compiled before a flight, and not in it."""

from __future__ import annotations

from skillwing.sim_mujoco.camera import camera, shading
from skillwing.sim_mujoco.sensors import depth_camera
from skillwing.sim_mujoco.simulator.simulator import Simulator
from skillwing.sim_mujoco.simulator.warm_up import compile_loops
from skillwing.sim_mujoco.world import embree
from skillwing.sim_mujoco.world.world import make_world


def compilations() -> dict[str, int]:
    """Number of variants of each compiled function."""
    modules = (embree, depth_camera, camera, shading)
    functions = [each for module in modules for each in vars(module).values() if hasattr(each, "signatures")]
    return {each.__name__: len(each.signatures) for each in functions}


def test_no_loop_is_compiled_in_flight() -> None:
    compile_loops()
    before = compilations()
    simulator = Simulator(make_world(2, "village"))
    simulator.camera.request(0.0, 15.0, 1.0, tilt=0.4)
    simulator.advance(0.3)
    assert simulator.camera.take(simulator.t, simulator.motion) is None
    assert simulator.camera.take(simulator.t + 0.1, simulator.motion) is not None
    assert compilations() == before
    assert all(before[name] > 0 for name in ("cast_hits", "developed", "_measured"))
