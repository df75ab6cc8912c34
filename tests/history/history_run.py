"""Record histories of the real resource manager process, with clients on sessions of their own, and check them.

    python tests/history/history_run.py --seconds 60 --kills 3 --write docs/reliability.md

Prints a line for each history, and what they add up to; a history that is not linearizable, or whose steps are out of
order, is told in full and ends the run with 1.
"""

from __future__ import annotations

import argparse
import math
import os
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from history_clients import Client, Goal, GoalUser, LossWatch, StepWatch
from history_figures import MARKS, Judged, table
from linearizability import Verdict, check
from sequential_manager import Call, Lose, Reply, SequentialManager, Told
from step_order import Observed, StepOrder, judge_order

from skillwing.dsl import load
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.names import RESOURCE_MANAGER, skill_process
from skillwing.services.processes.launcher import Launcher
from skillwing.services.protocol import RecordOutcome
from skillwing.services.robot import ProcessSpec
from skillwing.services.terminal.doc_sections import page_with

WORKSHOP = Path(__file__).parent / "workshop.skillset"
SCRIPT = WORKSHOP.with_suffix(".mock.toml")
HONEST = "skillwing.services.managers.resource_manager:make_resource_manager"
ROBOT = "workshop"
SKILL = "lift"
"""Skill of the real skill manager."""
HONEST_SKILL = "skillwing.services.mocking.system:make_mock_skill_process"
GOALS = 40
"""Goals of the real skill manager in each history."""
PATIENCE_WITH_THE_CROWD = 240.0
"""Wall seconds until a run counts as stuck."""


@dataclass(frozen=True)
class Recorded:
    """A history, the wall seconds in which it was recorded, the kills of its resource manager, and its steps."""

    history: tuple[Told, ...]
    seconds: float
    kills: int
    observed: Observed

    @property
    def unanswered(self) -> int:
        """Operations of which nobody knows whether they have happened."""
        return sum(told.answered is None for told in self.history)

    @property
    def local_outcomes(self) -> int:
        """Operations that end a goal which was never granted."""
        return sum(isinstance(told.call, RecordOutcome) for told in self.history)

    def check(self, most_steps: float = math.inf) -> Verdict[Call, Reply]:
        """Hold the history to the model; raises UndecidedError after so many steps."""
        return check(SequentialManager(load(WORKSHOP), self.history), self.history, most_steps)

    def check_order(self) -> StepOrder:
        """Hold the published steps to the replies and the journal."""
        called = (told for told in self.history if not isinstance(told.call, Lose))
        return judge_order(self.observed, [told.answer for told in called if told.answer is not None])


def record(
    run_dir: Path,
    *,
    seed: int = 0,
    clients: int = 4,
    operations: int = 300,
    kills: int = 0,
    factory: str = HONEST,
    journal: bool = True,
) -> Recorded:
    """The history of one resource manager process, asked by several clients at once.

    operations: of each client, about. kills: how often, evenly spread, the process is killed with -9 and started again.
    factory: what makes it. journal: it keeps one, so that it remembers across kills.
    """
    skillset = load(WORKSHOP)
    journal_file = run_dir / "journal.sqlite" if journal else None
    spec = _resource_manager(factory, journal_file)
    with Launcher(ROBOT, skillset.name, run_dir, clock="wall") as launcher:
        launcher.start((spec,))
        buses = [ZenohBus(f"client{number}", ROBOT, launcher.endpoint) for number in range(clients)]
        ear = ZenohBus("ear", ROBOT, launcher.endpoint)
        losses, steps = LossWatch(ear, skillset), StepWatch(ear, skillset)
        asked_for: dict[str, Goal] = {}
        crowd = [Client(bus, skillset, f"skill/{i % 3}", seed * 1000 + i, asked_for) for i, bus in enumerate(buses)]
        started = time.monotonic()
        threads = [threading.Thread(target=client.work, args=(operations,), name=client.name) for client in crowd]
        for thread in threads:
            thread.start()
        for number in range(kills):
            due = clients * operations * (number + 1) // (kills + 1)
            _listen(ear, lambda due=due: _done(crowd) >= due or not _any_alive(threads))
            os.kill(launcher.pids[RESOURCE_MANAGER], signal.SIGKILL)
            _listen(ear, lambda: not launcher.running(RESOURCE_MANAGER))
            launcher.start((spec,))
        _listen(ear, lambda: not _any_alive(threads))
        seconds = time.monotonic() - started
        observed = steps.observed(journal_file, kills)
        for bus in (*buses, ear):
            bus.close()
    history = [told for client in crowd for told in client.notebook.operations]
    return Recorded((*history, *losses.operations(history)), seconds, kills, observed)


def record_goals(
    run_dir: Path, *, seed: int = 0, goals: int = GOALS, kills: int = 0, factory: str = HONEST_SKILL
) -> Observed:
    """Steps of the resource manager and statuses of one real skill manager, which is made by `factory`.

    kills: how often the resource manager is killed with -9, each time while a goal may run.
    """
    skillset, journal = load(WORKSHOP), run_dir / "journal.sqlite"
    spec = _resource_manager(HONEST, journal)
    options = {"skillset": str(WORKSHOP), "skill": SKILL, "scripts": [str(SCRIPT)], "seed": seed}
    with Launcher(ROBOT, skillset.name, run_dir, clock="wall") as launcher:
        launcher.start((spec, ProcessSpec(skill_process(SKILL), factory, options)))
        ear = ZenohBus("ear", ROBOT, launcher.endpoint)
        steps, user = StepWatch(ear, skillset), GoalUser(ear, skillset, SKILL, seed)
        for _ in range(kills):
            user.use(goals // (kills + 1))
            goal = user.begin()
            os.kill(launcher.pids[RESOURCE_MANAGER], signal.SIGKILL)
            _listen(ear, lambda: not launcher.running(RESOURCE_MANAGER))
            launcher.start((spec,))
            user.end(goal)
        user.use(goals // (kills + 1))
        observed = replace(steps.observed(journal, kills), statuses=tuple(user.heard))
        ear.close()
    return observed


def _resource_manager(factory: str, journal: Path | None) -> ProcessSpec:
    options = {"skillset": str(WORKSHOP), **({"journal": str(journal)} if journal else {})}
    return ProcessSpec(RESOURCE_MANAGER, factory, options)


def _listen(ear: ZenohBus, done: Callable[[], bool]) -> None:
    """Hear what is published until `done` holds; raises TimeoutError if it never does."""
    deadline = time.monotonic() + PATIENCE_WITH_THE_CROWD
    while not done():
        if time.monotonic() > deadline:
            raise TimeoutError("the clients did not get on with their work")
        ear.run_until(lambda: False, 0.02)


def _any_alive(threads: Sequence[threading.Thread]) -> bool:
    return any(thread.is_alive() for thread in threads)


def _done(crowd: Sequence[Client]) -> int:
    return sum(len(client.notebook.operations) for client in crowd)


def main(arguments: list[str] | None = None) -> int:
    """Record and check history after history for a while; returns the exit code."""
    parser = argparse.ArgumentParser(description="Check histories of the real resource manager for linearizability.")
    parser.add_argument("--seconds", type=float, default=60.0, help="for how long to go on (default: %(default)s)")
    parser.add_argument("--clients", type=int, default=4, help="at once (default: %(default)s)")
    parser.add_argument("--operations", type=int, default=300, help="of each client (default: %(default)s)")
    parser.add_argument("--kills", type=int, default=2, help="kill -9 in every second history (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="of what clients ask for")
    parser.add_argument("--write", type=page_with(MARKS), metavar="FILE", help="document that gets the table")
    wanted = parser.parse_args(arguments)
    started = time.monotonic()
    judged: list[Judged] = []
    while len(judged) < 2 or time.monotonic() - started < wanted.seconds:
        seed = wanted.seed + len(judged)
        kills = wanted.kills if len(judged) % 2 else 0
        with tempfile.TemporaryDirectory() as folder:
            recorded = record(
                Path(folder), seed=seed, clients=wanted.clients, operations=wanted.operations, kills=kills
            )
        with tempfile.TemporaryDirectory() as folder:
            goals = record_goals(Path(folder), seed=seed, kills=kills)
        verdict, order, order_of_goals = recorded.check(), recorded.check_order(), judge_order(goals, ())
        told = f"{len(recorded.history)} operations in {recorded.seconds:.1f} s, {kills} kills, "
        sys.stdout.write(f"seed {seed}: {told}{recorded.unanswered} unanswered: {verdict}\n")
        sys.stdout.writelines(f"    {problem}\n" for problem in (*order.problems, *order_of_goals.problems))
        judged.append(
            Judged(
                seed=seed,
                operations=len(recorded.history),
                kills=kills,
                unanswered=recorded.unanswered,
                local_outcomes=recorded.local_outcomes,
                steps=verdict.steps,
                linearizable=verdict.linearizable,
                published=len(recorded.observed.steps),
                unsent=order.missing_steps,
                ordered=not order.problems,
                statuses=len(goals.statuses),
                followed=not order_of_goals.problems,
            )
        )
        if not judged[-1].passed:
            break
    figures = table(judged, time.monotonic() - started)
    sys.stdout.write("\n".join([*figures, ""]))
    if wanted.write is not None:
        MARKS.replace(wanted.write, "\n".join(figures))
    return 0 if all(each.passed for each in judged) else 1


if __name__ == "__main__":
    sys.exit(main())
