"""A skillset as real processes: router and managers on loopback, all of them ended with the bench."""

from __future__ import annotations

import os
import signal
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from skillwing.dsl.model import UnknownNameError
from skillwing.services.bus import Topology
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.journal.journal import set_aside
from skillwing.services.mocking.system import mock_processes
from skillwing.services.names import JOURNAL_FILE
from skillwing.services.options import imported
from skillwing.services.processes.colocation import colocated, process_groups
from skillwing.services.processes.launcher import Launcher
from skillwing.services.robot import ProcessSpec, Robot
from skillwing.services.testing.bench import CLIENT, Bench
from skillwing.services.testing.context import model_of
from skillwing.services.testing.fake_layer import FakeLayer


class SkillsetProcesses(Bench):
    """Managers as processes, in wall time, at a free port.

    skillset: path of the file. hooks: by skill, the class as `package.module:Class`, importable by the processes; mocks
    play the other skills by the files `scripts`. run_dir: gets `logs/<process>.log` and a new journal, from which a
    restarted resource manager continues. data: as in `SkillsetInProcess`, published by the test's own process while a
    call waits. layer: the fake functional layer, on the test's session. processes: further processes of the robot.
    colocate: all managers but the resource manager share one process; topology: how processes connect.

    Raises StartError, with the last lines of its log, for a process that does not start. Use it as a context manager:
    after `close` no process is left.
    """

    def __init__(
        self,
        skillset: str | Path,
        hooks: Mapping[str, str] | None = None,
        *,
        run_dir: Path,
        scripts: Sequence[Path] = (),
        data: Mapping[str, object] | None = None,
        layer: FakeLayer | None = None,
        processes: tuple[ProcessSpec, ...] = (),
        colocate: bool = False,
        topology: Topology = "router",
    ) -> None:
        model = model_of(skillset)
        classes = {model.skill(skill).name: imported({"hooks": path}, "hooks") for skill, path in (hooks or {}).items()}
        robot = Robot(
            name=model.name,
            skillset=Path(skillset).resolve(),
            hooks=dict(hooks or {}),
            clock="wall",
        )
        set_aside(run_dir / JOURNAL_FILE)
        mocked = [skill.name for skill in model.skills if skill.name not in classes]
        specs = (*processes, *mock_processes(robot, scripts=scripts, skills=mocked, run={"run_dir": run_dir}))
        self.launcher = Launcher(robot.name, model.name, run_dir, clock=robot.clock, topology=topology)
        # A robot can do without some of them, a test without none.
        needed = tuple(replace(spec, essential=True) for spec in (colocated(specs) if colocate else specs))
        self._processes = {each.name: each.nodes for each in process_groups(needed)}
        with ExitStack() as undoing:
            undoing.callback(self.launcher.stop)
            self.launcher.start(needed)
            bus = ZenohBus(CLIENT, robot.name, self.launcher.endpoint, topology=topology)
            undoing.callback(bus.close)
            layer = layer or FakeLayer()
            layer.attach(bus)
            super().__init__(bus, model, layer, types=classes)
            self.set_data(**(data or {}))
            undoing.pop_all()

    def close(self) -> None:
        """End every process. Idempotent."""
        try:
            super().close()
        finally:
            self.launcher.stop()

    def kill(self, process: str) -> None:
        """Kill a process with -9. Raises UnknownNameError for one that does not run."""
        running = [name for name in self.launcher.pids if self.launcher.running(name)]
        if process not in running:
            raise UnknownNameError("running process", process, running)
        os.kill(self.launcher.pids[process], signal.SIGKILL)
        # No message reports that a process has been reaped, so the loop polls.
        while self.launcher.running(process):
            self.run(0.01)

    def restart(self, process: str) -> None:
        """Restart a killed process. Raises UnknownNameError for a process that is not part of this system."""
        if process not in self._processes:
            raise UnknownNameError("process", process, self._processes)
        self.launcher.start(self._processes[process])
