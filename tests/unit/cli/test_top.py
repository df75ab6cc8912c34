"""Output of `top` on a small screen."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, cast

import pytest
from rich.console import Console

from faulty_network import FaultyNetwork
from skillwing.dsl import parse
from skillwing.services.bus import Request
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.connection import Target
from skillwing.services.commands.top import FEWEST, SystemTop, busiest
from skillwing.services.processes.proc_files import Usage
from skillwing.services.processes.process_monitor import ProcessStatus
from skillwing.services.processes.process_state import ProcessCondition, ProcessState
from skillwing.services.protocol import (
    Ending,
    GoalStatus,
    Keys,
    Record,
    RecordKind,
    ResourceStates,
    ResourceStep,
    State,
    Terminal,
    encode,
)
from skillwing.services.terminal.connection import System
from skillwing.services.terminal.process_table import duration, process_table

if TYPE_CHECKING:
    from skillwing.services.bus.zenoh_bus import ZenohBus

DONE = Terminal(ending=Ending.SUCCEEDED, reason="done", result="DONE", success=True)
USED = Usage(cpu=1.0, memory=46 << 20, uptime=200.0, stopped=False)
ENTRIES = [
    ProcessStatus(
        ProcessState(name=name, pid=pid), ProcessCondition.DOWN if name == "d" else ProcessCondition.RUNS, USED
    )
    for pid, name in enumerate("abcdef", start=1)
]
CPU = {"a": 1.0, "b": 9.0, "c": 5.0, "f": 2.0}


@pytest.mark.parametrize(("room", "shown"), [(6, "abcdef"), (4, "bcdf"), (3, "bcd"), (-5, "bcd")])
def test_what_is_not_well_comes_first_and_then_what_uses_most(room: int, shown: str) -> None:
    assert "".join(entry.state.name for entry in busiest(ENTRIES, CPU, room)) == shown
    assert len(shown) >= FEWEST


def test_the_table_shows_what_each_process_uses() -> None:
    console = Console(file=io.StringIO(), width=100)
    console.print(process_table(ENTRIES[:2], CPU))
    assert isinstance(console.file, io.StringIO)
    lines = [line.split() for line in console.file.getvalue().splitlines()]
    assert lines[1] == ["a", "runs", "1", "3", "min", "20", "s", "1.0", "46", "MB"]


def test_what_processes_elsewhere_use_is_not_known_and_not_nothing() -> None:
    network = InProcessNetwork()
    target = Target("kite-of-a-test", "tcp/elsewhere:7447", Path("kite.skillset"), "wall")
    kite = parse("skillset kite { skill reel { result { success DONE } } }")
    top = SystemTop(System(target, cast("ZenohBus", network.bus("cli")), kite))
    network.bus("reel").declare_alive("kite/alive/skill/reel")
    network.run_for(0.1)
    top.update()
    used = top.facts()["processes"]["skill/reel"]
    assert (used["state"], used["cpu_percent"], used["memory_bytes"]) == ("runs", None, None)
    console = Console(file=io.StringIO(), width=100)
    console.print(top.picture())
    assert isinstance(console.file, io.StringIO)
    assert "skill/reel" in console.file.getvalue()
    assert "CPU" not in console.file.getvalue()


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.9, "0 s"), (59.9, "59 s"), (60.0, "1 min 00 s"), (7500.0, "2 h 05 min")]
)
def test_durations_are_short(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_a_lost_link_is_shown_until_it_is_back() -> None:
    network = FaultyNetwork()
    target = Target("kite-of-a-test", "tcp/elsewhere:7447", Path("kite.skillset"), "wall", without_goals="It floats.")
    kite = parse("skillset kite { skill reel { result { success DONE } } }")
    bus = network.join("cli")
    top = SystemTop(System(target, cast("ZenohBus", bus), kite))

    def shown() -> str:
        console = Console(file=io.StringIO(), width=200)
        console.print(top.picture())
        assert isinstance(console.file, io.StringIO)
        return console.file.getvalue()

    network.run_for(1.0)
    assert "has not answered" not in shown()
    network.cut(bus)
    network.run_for(3.0)
    assert "tcp/elsewhere:7447 has not answered since " in shown()
    assert "A mission on board goes on. It floats." in shown()
    network.reconnect(bus)
    network.run_for(1.0)
    assert "has not answered" not in shown()


def test_a_goal_is_shown_with_the_states_that_ended_it() -> None:
    """The answer before would have the states from before the end."""
    network = FaultyNetwork()
    winch = parse(
        """
        skillset winch {
            resource drum { initial FREE  FREE -> USED  USED -> FREE }
            skill pull {
                effect { take: drum -> USED  leave: drum -> FREE }
                precondition { success take }
                result { DONE: apply=leave }
            }
        }
        """
    )
    keys = Keys("winch")
    manager = network.join("resource_manager")
    asked: list[Request] = []
    manager.serve(keys.resource_states, asked.append)
    steps, statuses = (manager.advertise(key, events=True) for key in (keys.resource_steps, keys.status("pull")))
    target = Target("winch-of-a-test", "tcp/elsewhere:7447", Path("winch.skillset"), "wall")
    top = SystemTop(System(target, cast("ZenohBus", network.join("cli")), winch))
    top.update()
    network.run_for(1.0)
    for request in asked:
        request.reply(encode(ResourceStates(step=1, states={"drum": "USED"}, t=0.0)))
    network.run_for(0.5)
    statuses.put(encode(GoalStatus(goal_id="g", skill="pull", state=State.RUNNING, t=0.5, after_step=1)))
    network.run_for(0.5)
    facts = top.facts()
    assert (facts["skills"]["pull"]["state"], facts["resources"]["drum"].state) == ("RUNNING", "USED")
    ended = GoalStatus(goal_id="g", skill="pull", state=State.TERMINATED, t=1.0, terminal=DONE, after_step=2)
    statuses.put(encode(ended))
    network.run_for(0.05)
    assert top.facts()["skills"]["pull"]["state"] == "RUNNING"
    change = Record(
        id="rm#2",
        t=1.0,
        source="resource_manager",
        kind=RecordKind.RESOURCE,
        subject="drum",
        before="USED",
        after="FREE",
    )
    steps.put(encode(ResourceStep(number=2, t=1.0, records=(change,))))
    network.run_for(0.05)
    facts = top.facts()
    assert (facts["skills"]["pull"]["state"], facts["resources"]["drum"].state) == ("IDLE", "FREE")
