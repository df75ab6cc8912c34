"""Packets of eight rays, cast by Embree's C interface from compiled loops.

The package `embreex` brings the library, but casts one ray at a time. Neighbouring rays of a sensor take nearly the
same way through the tree of boxes. As a packet they take a quarter of the time.

A packet is an array (24, 8): one row for each field of `RTCRayHit8`, one column for each ray. The last two rows hold
the mask of valid rays and the arguments of the call.
"""

from __future__ import annotations

import ctypes
import weakref
from typing import Any

import numpy as np
from embreex import rtcore_scene
from llvmlite import binding
from numba import types
from numpy.typing import NDArray

from skillwing.sim_mujoco.compiled import compiled
from skillwing.sim_mujoco.world.triangles import Triangles

Floats = NDArray[np.float32]
Words = NDArray[np.int32]

# The extension module is linked to Embree, so that its handle finds Embree's functions under any name of the library.
_library = ctypes.CDLL(rtcore_scene.__file__)
_LANES = 8
_ORIGIN, _NEAR, _DIRECTION, _TIME, _FAR, _MASK, _ID, _FLAGS = 0, 3, 4, 7, 8, 9, 10, 11
_NORMAL, _TRIANGLE, _GEOMETRY = 12, 17, 18
_VALID, _ARGUMENTS = 22, 23
_ROWS = 24
_COHERENT = 1 << 16
_TRIANGLES, _INDICES, _VERTICES, _UINT3, _FLOAT3, _ROBUST = 0, 0, 1, 0x5003, 0x9003, 4


def _function(name: str, result: Any, *arguments: Any) -> Any:
    function = getattr(_library, name)
    function.restype, function.argtypes = result, arguments
    return function


def _symbol(name: str) -> types.ExternalFunction:
    """A function of four addresses for compiled loops; it is found by name, so that these can be cached."""
    binding.add_symbol(name, ctypes.cast(getattr(_library, name), ctypes.c_void_p).value or 0)
    return types.ExternalFunction(name, types.void(*(types.uintp,) * 4))


_intersect = _symbol("rtcIntersect8")
_occluded = _symbol("rtcOccluded8")
_pointer, _int, _size = ctypes.c_void_p, ctypes.c_int, ctypes.c_size_t
_new_device = _function("rtcNewDevice", _pointer, ctypes.c_char_p)
_new_scene = _function("rtcNewScene", _pointer, _pointer)
_set_flags = _function("rtcSetSceneFlags", None, _pointer, _int)
_new_geometry = _function("rtcNewGeometry", _pointer, _pointer, _int)
_new_buffer = _function("rtcSetNewGeometryBuffer", _pointer, _pointer, _int, ctypes.c_uint, _int, _size, _size)
_commit_geometry = _function("rtcCommitGeometry", None, _pointer)
_attach = _function("rtcAttachGeometry", ctypes.c_uint, _pointer, _pointer)
_commit_scene = _function("rtcCommitScene", None, _pointer)
_release_geometry = _function("rtcReleaseGeometry", None, _pointer)
_release_scene = _function("rtcReleaseScene", None, _pointer)
_release_device = _function("rtcReleaseDevice", None, _pointer)


class TriangleScene:
    """Embree's tree of boxes over triangles, at an `address` for the functions below."""

    def __init__(self, triangles: Triangles, *, robust: bool = False) -> None:
        device = _new_device(b"")
        self.address: int = _new_scene(device)
        _set_flags(self.address, _ROBUST if robust else 0)
        geometry = _new_geometry(device, _TRIANGLES)
        for kind, form, values in (
            (_VERTICES, _FLOAT3, np.ascontiguousarray(triangles.vertices, dtype=np.float32)),
            (_INDICES, _UINT3, np.ascontiguousarray(triangles.faces, dtype=np.int32)),
        ):
            ctypes.memmove(
                _new_buffer(geometry, kind, 0, form, values.itemsize * 3, len(values)),
                values.ctypes.data,
                values.nbytes,
            )
        _commit_geometry(geometry)
        _attach(self.address, geometry)
        _release_geometry(geometry)
        _commit_scene(self.address)
        weakref.finalize(self, _release, self.address, device)


def _release(scene: int, device: int) -> None:
    _release_scene(scene)
    _release_device(device)


@compiled
def _packet() -> Floats:
    """A packet without rays, at an address that is a multiple of 64."""
    room = np.zeros(_ROWS * _LANES + 16, dtype=np.float32)
    first = (64 - room.ctypes.data % 64) % 64 // 4
    packet = room[first : first + _ROWS * _LANES].reshape(_ROWS, _LANES)
    words = packet.view(np.int32)
    words[_MASK, :] = -1
    words[_ARGUMENTS, 0], words[_ARGUMENTS, 1] = _COHERENT, -1
    return packet


@compiled
def _load(packet: Floats, words: Words, origins: Floats, directions: Floats, first: int, reach: np.float32) -> int:
    """Put the rays from number `first` on into the packet, and return how many there are."""
    count = min(len(directions) - first, _LANES)
    share = len(directions) // len(origins)
    start = first // share
    next_start = (start + 1) * share
    for lane in range(_LANES):
        words[_VALID, lane] = -1 if lane < count else 0
    for lane in range(count):
        ray = first + lane
        if ray == next_start:
            start, next_start = start + 1, next_start + share
        for axis in range(3):
            packet[_ORIGIN + axis, lane] = origins[start, axis]
            packet[_DIRECTION + axis, lane] = directions[ray, axis]
        packet[_FAR, lane] = reach
        words[_TRIANGLE, lane] = words[_GEOMETRY, lane] = -1
    return count


@compiled
def cast_distances(scene: int, origins: Floats, directions: Floats, reach: np.float32, nothing: np.float32) -> Floats:
    """Distances (N,) along directions (N, 3); `nothing` where there is nothing nearer than `reach`.

    Each of the origins (M, 3) belongs to N / M directions in turn.
    """
    packet = _packet()
    words, address = packet.view(np.int32), packet.ctypes.data
    distances = np.empty(len(directions), dtype=np.float32)
    for first in range(0, len(directions), _LANES):
        count = _load(packet, words, origins, directions, first, reach)
        _intersect(address + 32 * _VALID, scene, address, address + 32 * _ARGUMENTS)
        for lane in range(count):
            distance = packet[_FAR, lane]
            distances[first + lane] = nothing if distance >= reach else distance
    return distances


@compiled
def cast_faces(scene: int, origins: Floats, directions: Floats, reach: np.float32) -> tuple[Floats, Words]:
    """Distances as above with 0 for nothing, and the numbers of the triangles, -1 for none."""
    packet = _packet()
    words, address = packet.view(np.int32), packet.ctypes.data
    distances = np.zeros(len(directions), dtype=np.float32)
    faces = np.full(len(directions), -1, dtype=np.int32)
    for first in range(0, len(directions), _LANES):
        count = _load(packet, words, origins, directions, first, reach)
        _intersect(address + 32 * _VALID, scene, address, address + 32 * _ARGUMENTS)
        for lane in range(count):
            if words[_TRIANGLE, lane] >= 0 and packet[_FAR, lane] < reach:
                distances[first + lane] = packet[_FAR, lane]
                faces[first + lane] = words[_TRIANGLE, lane]
    return distances, faces


@compiled
def cast_hits(scene: int, origins: Floats, directions: Floats, reach: np.float32) -> tuple[Floats, Floats]:
    """Distances as above with 0 for nothing, and cosines of the incidence, 0 for nothing."""
    packet = _packet()
    words, address = packet.view(np.int32), packet.ctypes.data
    distances = np.zeros(len(directions), dtype=np.float32)
    cosines = np.zeros(len(directions), dtype=np.float32)
    for first in range(0, len(directions), _LANES):
        count = _load(packet, words, origins, directions, first, reach)
        _intersect(address + 32 * _VALID, scene, address, address + 32 * _ARGUMENTS)
        for lane in range(count):
            if packet[_FAR, lane] >= reach:
                continue
            x, y, z = packet[_NORMAL, lane], packet[_NORMAL + 1, lane], packet[_NORMAL + 2, lane]
            ray = first + lane
            along = x * directions[ray, 0] + y * directions[ray, 1] + z * directions[ray, 2]
            distances[ray] = packet[_FAR, lane]
            cosines[ray] = abs(along) / np.sqrt(x * x + y * y + z * z)
    return distances, cosines


@compiled
def cast_blocked(scene: int, origins: Floats, directions: Floats, reach: np.float32) -> NDArray[np.bool_]:
    """Mask (N,) of rays with anything nearer than `reach`."""
    packet = _packet()
    words, address = packet.view(np.int32), packet.ctypes.data
    blocked = np.zeros(len(directions), dtype=np.bool_)
    for first in range(0, len(directions), _LANES):
        count = _load(packet, words, origins, directions, first, reach)
        _occluded(address + 32 * _VALID, scene, address, address + 32 * _ARGUMENTS)
        for lane in range(count):
            blocked[first + lane] = packet[_FAR, lane] < 0.0
    return blocked
