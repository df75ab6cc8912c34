"""A tree of routers: two mocked robots at a router each, and a station at the router above both."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from command_line import Command
from running_system import PATIENCE, until
from shuttle import SHUTTLE

from skillwing.services.bus.router_robots import robots_at
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.history.history import History
from skillwing.services.processes.run_state import read_run_state
from skillwing.services.protocol import Keys, Record
from skillwing.services.terminal.exit_codes import OK, USAGE

pytestmark = pytest.mark.slow

ROBOTS = ("first", "second")
TREE = """
<root BTCPP_format="4" main_tree_to_execute="both">
  <BehaviorTree ID="both"><ParallelAll><go robot="first"/><go robot="second"/></ParallelAll></BehaviorTree>
  <TreeNodesModel>
    <SubTree ID="both"><MetadataFields><Metadata robots="first second"/></MetadataFields></SubTree>
  </TreeNodesModel>
</root>
"""


class RouterProcess:
    """A router as a process, which can be started again at the same address."""

    def __init__(self, *words: str) -> None:
        self._words = words
        self.endpoint = ""
        self.start("tcp/127.0.0.1:0")

    def start(self, listen: str) -> None:
        command = [sys.executable, "-m", "skillwing.services.terminal.cli", "router", "--listen", listen]
        self.process = subprocess.Popen([*command, *self._words], stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        self.endpoint = self.process.stdout.readline().strip()
        assert self.endpoint

    def restart(self) -> None:
        """Kill the router with -9, and start it at the same address."""
        self.process.kill()
        self.process.wait(PATIENCE)
        self.start(self.endpoint)

    def stop(self) -> None:
        self.process.send_signal(signal.SIGINT)
        self.process.wait(PATIENCE)


@dataclass
class Tree:
    """The upper router, and the router of each robot."""

    upper: RouterProcess
    routers: dict[str, RouterProcess] = field(default_factory=dict[str, RouterProcess])


@pytest.fixture(scope="module")
def tree(skillwing: Command, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tree]:
    folder = tmp_path_factory.mktemp("tree")
    file = folder / "shuttle.skillset"
    file.write_text(SHUTTLE, encoding="utf-8")
    found = Tree(RouterProcess())
    try:
        for name in ROBOTS:
            router = found.routers[name] = RouterProcess("--connect", found.upper.endpoint)
            words = ("--robot-name", name, "--router", router.endpoint, "--run-dir", str(folder / name))
            said = skillwing("mock", str(file), *words, "--detach", "--no-record")
            assert said.code == OK, said.error
        yield found
    finally:
        for name in ROBOTS:
            skillwing("down", "--robot", name)
        for router in (*found.routers.values(), found.upper):
            router.stop()


@pytest.fixture
def station(tree: Tree, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Tree:
    """A place at the upper router without run states, as another machine is."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("SKILLWING_CONNECT", tree.upper.endpoint)
    monkeypatch.delenv("SKILLWING_ROBOT", raising=False)
    until(lambda: set(robots_at(tree.upper.endpoint)) == set(ROBOTS), "both robots at the upper router")
    return tree


def test_a_station_at_the_upper_router_commands_both_robots(station: Tree, skillwing: Command) -> None:
    for name in ROBOTS:
        said = skillwing("start", "go", "--robot", name, "--follow")
        assert said.code == OK, said.error
    assert set(robots_at(station.routers["first"].endpoint)) == set(ROBOTS), "from branch to branch"


@pytest.mark.usefixtures("station")
@pytest.mark.parametrize("words", [(), ("--on-board",)])
def test_a_mission_spans_both_branches(skillwing: Command, words: tuple[str, ...], tmp_path: Path) -> None:
    file = tmp_path / "both.xml"
    file.write_text(TREE, encoding="utf-8")
    said = skillwing("mission", "run", str(file), *words, "--json")
    assert said.code == OK, said.error
    assert said.json["phase"] == "SUCCEEDED"


def test_who_comes_late_hears_the_whole_history_with_all_causes(tree: Tree, skillwing: Command) -> None:
    assert skillwing("start", "go", "--robot", "first", "--follow").code == OK
    records: dict[str, Record] = {}
    with closing(ZenohBus("late", "first", tree.upper.endpoint)) as bus:
        follow_records(bus, Keys("shuttle"), lambda record: records.update({record.id: record}))

        def missing() -> list[Record]:
            return [record for record in records.values() if record.cause is not None and record.cause not in records]

        def is_whole() -> bool:
            return any(each.after == "S_THERE" for each in records.values()) and not missing()

        assert bus.run_until(is_whole, PATIENCE), missing()
    end = next(each.id for each in records.values() if each.after == "S_THERE")
    chain = History.of(list(records.values())).chain(end)
    assert {"GRANTED", "RUNNING"} <= {each.after for each in chain}, chain


def test_the_death_of_a_manager_is_seen_over_two_routers(tree: Tree) -> None:
    state = read_run_state("first")
    assert state is not None
    manager = next(each.pid for each in state.processes if each.name == "skill/go")
    assert manager is not None
    alive = list[bool]()
    with closing(ZenohBus("watch", "first", tree.upper.endpoint)) as bus:
        bus.watch_alive(Keys("shuttle").alive("skill/go"), lambda _, present: alive.append(present))
        assert bus.run_until(lambda: alive == [True], PATIENCE)
        os.kill(manager, signal.SIGKILL)
        assert bus.run_until(lambda: alive == [True, False, True], PATIENCE), "it is started again"


@pytest.mark.parametrize("which", ["upper", "first"])
def test_a_router_that_is_killed_and_started_again_joins_the_tree(
    station: Tree, skillwing: Command, which: str
) -> None:
    (station.upper if which == "upper" else station.routers[which]).restart()
    until(lambda: set(robots_at(station.upper.endpoint)) == set(ROBOTS), "both robots at the upper router")
    for name in ROBOTS:
        said = skillwing("start", "go", "--robot", name, "--follow")
        assert said.code == OK, said.error


@pytest.mark.parametrize(
    ("words", "problem"),
    [(("tls/127.0.0.1:1",), "A tree of routers has no keys"), (("127.0.0.1",), "no address of a router")],
)
def test_a_tree_that_cannot_be_is_refused(skillwing: Command, words: tuple[str, ...], problem: str) -> None:
    said = skillwing("router", "--connect", *words)
    assert said.code == USAGE
    assert problem in said.error
