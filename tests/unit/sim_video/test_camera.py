"""The camera sees what stands there, only while it is asked to."""

from __future__ import annotations

import math

import numpy as np
import pytest

from skillwing.onboard.frames.vectors import Motion, Vector
from skillwing.sim_mujoco.camera.camera import Camera, trace
from skillwing.sim_mujoco.camera.feed import CameraFeed
from skillwing.sim_mujoco.sensors.depth_camera import DepthCamera
from skillwing.sim_mujoco.sensors.depth_pictures import DELAY
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.world import World, make_world


@pytest.fixture(scope="module")
def world() -> World:
    return make_world(1, "inspection")


@pytest.fixture(scope="module")
def rays(world: World) -> RayScene:
    return RayScene(world.triangles())


@pytest.fixture(scope="module")
def camera(world: World, rays: RayScene) -> Camera:
    return Camera(world, rays)


def at(position: Vector, heading: float = 0.0) -> Motion:
    half = heading / 2
    return Motion(0.0, position, (0.0, 0.0, 0.0), (math.cos(half), 0.0, 0.0, math.sin(half)), (0.0, 0.0, 0.0))


def test_the_same_motion_gives_the_same_picture(world: World, rays: RayScene, camera: Camera) -> None:
    here = at((8.0, 0.0, 13.0))
    assert np.array_equal(camera.picture(here), Camera(world, rays).picture(here))


def test_sky_above_and_building_ahead(camera: Camera, world: World, rays: RayScene) -> None:
    here = at((8.0, 0.0, 13.0))
    picture = camera.picture(here).astype(int)
    depth = DepthCamera(rays, np.random.default_rng(0)).true_depth(here)
    sky_is_blue = picture[..., 2] > picture[..., 0] + 8
    assert sky_is_blue[:60][depth[:60] == 0.0].mean() > 0.95
    near = (depth > 0.0) & (depth < 15.0)
    assert near.mean() > 0.3
    assert sky_is_blue[near].mean() < 0.05


def test_what_is_interpolated_is_what_would_be_cast() -> None:
    """Two planes that meet along a slanting edge, and a sky: all pixels are right, and few of them were cast."""
    rows, columns = np.mgrid[:60, :80]
    face = np.where(columns + rows // 3 < 50, 0, 1).astype(np.int32)
    inverse = np.where(face == 0, 0.1 + 0.001 * columns, 0.3 - 0.002 * rows).astype(np.float32)
    face[:10], inverse[:10] = -1, 0.0
    cast_pixels = 0

    def cast(pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        nonlocal cast_pixels
        cast_pixels += len(pixels)
        return inverse.take(pixels), face.take(pixels)

    found_inverse, found_face = trace(60, 80, np.array([0, 1, -1], dtype=np.int32), cast)
    assert np.array_equal(found_face, face)
    assert np.allclose(found_inverse, inverse, atol=1e-6)
    assert cast_pixels < 0.35 * face.size


def test_a_camera_turned_down_sees_the_ground(camera: Camera) -> None:
    high_up = at((0.0, 0.0, 20.0), math.pi)
    level, down = camera.picture(high_up).astype(int), camera.picture(high_up, tilt=1.2).astype(int)
    green = [(p[..., 1] > p[..., 2]).mean() for p in (level, down)]
    assert green[0] < 0.6
    assert green[1] > 0.9


def test_from_near_a_wall_has_more_detail_than_from_afar(camera: Camera) -> None:
    """A pattern fades with distance instead of flickering."""
    near, far = (camera.picture(at((x, 0.0, 13.0))).astype(float)[60:120, 140:180] for x in (12.0, -150.0))
    assert np.abs(np.diff(near, axis=1)).mean() > 1.0
    step = camera.picture(at((-150.0, 0.01, 13.0))).astype(float)[60:120, 140:180]
    assert np.abs(step - far).mean() < 3.0


class Counting:
    """Counts pictures instead of rendering them."""

    def __init__(self) -> None:
        self.taken = 0

    def picture(self, motion: Motion, tilt: float = 0.0) -> np.ndarray:
        self.taken += 1
        return np.full((180, 320, 3), self.taken, dtype=np.uint8)


class Shoot:
    """A feed, and how many pictures come out of it in a time."""

    def __init__(self) -> None:
        self.made: list[Counting] = []
        self.t = 0.0
        self.feed = CameraFeed(self._make, np.random.default_rng(0))

    def _make(self) -> Counting:
        self.made.append(Counting())
        return self.made[-1]

    def run(self, seconds: float) -> int:
        count = 0
        for _ in range(round(seconds / 0.02)):
            self.t += 0.02
            count += self.feed.take(self.t, at((0.0, 0.0, 5.0))) is not None
        return count


@pytest.mark.parametrize("fps", [5.0, 12.0, 15.0, 30.0])
def test_pictures_come_at_the_rate_that_is_wanted_as_long_as_they_are(fps: float) -> None:
    shoot = Shoot()
    assert shoot.run(1.0) == 0
    assert not shoot.made, "a camera that nobody wants is not even made"
    shoot.feed.request(shoot.t, fps, 3.0, 0.0)
    assert shoot.run(2.0) == pytest.approx(2.0 * fps, abs=1)
    shoot.feed.request(shoot.t, fps, 3.0, 0.0)
    assert shoot.run(10.0) == pytest.approx(3.0 * fps, abs=2), "and one that was under way"
    assert shoot.made[0].taken == pytest.approx(5.0 * fps, abs=2)


def test_a_picture_comes_late_and_says_when_it_was_taken() -> None:
    shoot = Shoot()
    shoot.feed.request(0.0, 10.0, 1.0, 0.0)
    shots = {0.01 * k: shoot.feed.take(0.01 * k, at((0.0, 0.0, 5.0))) for k in range(130)}
    late = [t - shot.t for t, shot in shots.items() if shot is not None]
    assert late == pytest.approx([DELAY] * 11, abs=1e-6), "the last one, too, though it is ready when none is wanted"


def test_faults_of_the_camera() -> None:
    shoot = Shoot()
    shoot.feed.request(0.0, 10.0, 60.0, 0.0)
    shoot.feed.corruption.switch("blackout", on=True)
    assert shoot.run(2.0) == 0
    shoot.feed.corruption.switch("blackout", on=False)
    shoot.feed.corruption.switch("bias", on=True, magnitude=400.0)
    shot = None
    while shot is None:
        shot = shoot.feed.take(shoot.t, at((0.0, 0.0, 5.0)))
        shoot.t += 0.02
    assert shot.picture.dtype == np.uint8
    assert shot.picture.min() == 255
