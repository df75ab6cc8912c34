"""Starts of processes: libraries that only some processes need are not imported by all of them."""

from __future__ import annotations

import subprocess
import sys

import pytest

HOST = "skillwing.services.processes.node_host"
KEYS_ONLY = {"cryptography", "ssl"}
"""Libraries for certificates."""


@pytest.mark.parametrize(
    "modules",
    [
        (HOST, "skillwing.services.managers.skill_manager", "skillwing.m600.skills.takeoff"),
        (HOST, "skillwing.services.managers.resource_manager"),
        ("skillwing.services.processes.router",),
    ],
    ids=lambda modules: modules[-1].rpartition(".")[2],
)
def test_a_process_without_keys_does_not_import_the_libraries_for_certificates(modules: tuple[str, ...]) -> None:
    program = f"import sys, {', '.join(modules)}; print(*(each for each in sys.modules if '.' not in each))"
    done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    imported = set(done.stdout.split())
    assert "zenoh" in imported
    assert imported & KEYS_ONLY == set()
