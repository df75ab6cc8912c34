"""Notices that the system under a mission was stopped: its processes go one after another, and none says why."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.services.bus import Bus
from skillwing.services.client.connection import Target
from skillwing.services.processes.run_state import read_run_state

CHECK_PERIOD = 0.1
"""Wall seconds; `up` says that it ends before it ends anything."""


def when_stopped(bus: Bus, target: Target, act: Callable[[], None]) -> None:
    """Call `act` once the system is no more, as long as the bus runs. Of one that was found by its endpoint nobody
    here can tell."""
    if target.pid is None:
        return

    def look() -> None:
        state = read_run_state(target.robot)
        if state is None or state.pid != target.pid:
            act()
        else:
            bus.after(CHECK_PERIOD, look, wall=True)

    look()
