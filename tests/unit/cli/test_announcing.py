"""The moment from which a system is announced."""

from __future__ import annotations

import signal
from pathlib import Path
from queue import SimpleQueue

import pytest

from skillwing.m600.robot import ROBOT
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.bus.zenoh_session import RouterUnreachableError
from skillwing.services.processes.launcher import Launcher
from skillwing.services.processes.launcher_node import LauncherNode
from skillwing.services.processes.run_state import announced, read_run_state
from skillwing.services.processes.stop_signal import StopSignal
from skillwing.services.terminal.foreground_supervisor import ForegroundSupervisor
from skillwing.services.terminal.output import make_console


class LauncherWithoutRouter(Launcher):
    """A launcher whose router has stopped after the start of the processes."""

    def open_bus(self, name: str) -> ZenohBus:
        raise RouterUnreachableError("tcp/127.0.0.1:1")


def test_a_system_whose_launcher_has_no_connection_is_not_announced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    launcher = LauncherWithoutRouter("m600", "m600", tmp_path)
    node = LauncherNode(launcher, ROBOT, "m600", {})
    stop = StopSignal()
    supervisor = ForegroundSupervisor(
        *(make_console(), launcher, node, lambda: announced(ROBOT, "tcp/127.0.0.1:1", tmp_path)),
        *(SimpleQueue(), "m600", stop),
    )
    with pytest.raises(RouterUnreachableError), supervisor:
        pass
    assert read_run_state("m600") is None
    stop.receive(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), supervisor:
        pass
