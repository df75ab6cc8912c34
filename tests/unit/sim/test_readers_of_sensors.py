"""Readers of the table of sensors, such as launcher and link, start without the libraries of the simulator."""

from __future__ import annotations

import subprocess
import sys

READERS = "skillwing.sim_mujoco.link.node, skillwing.sim_mujoco.launching"
LIBRARIES = {"embreex", "mujoco", "numba", "scipy", "small_gicp"}


def test_launcher_and_link_load_neither_compiler_nor_physics() -> None:
    program = f"import sys, {READERS}\nprint(*{LIBRARIES} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
