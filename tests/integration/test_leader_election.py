"""Leader election: a process beside an active resource manager gives way; the successor of a dead one takes over."""

from __future__ import annotations

from pathlib import Path

import pytest

from faulty_network import FaultyNetwork, NetworkConditions
from skillwing.dsl import parse
from skillwing.services.bus import Answer, Answered, Bus
from skillwing.services.bus.inprocess import InProcessBus
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.managers.leader_election import PATIENCE
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import FireExtern, Keys, Message, QueryStates, ResourceStates, decode, encode

DOOR = parse(
    "skillset door { resource lock { initial SHUT  extern SHUT -> OPEN  extern OPEN -> SHUT } }", "door.skillset"
)
KEYS = Keys(DOOR.name)
IDENTITY = Identity("", DOOR.name, DOOR.schema_hash)


class Door:
    """A network with resource managers that each have a journal of their own, and a client."""

    def __init__(self, seed: int = 0, conditions: NetworkConditions | None = None) -> None:
        self.network = FaultyNetwork(seed, conditions or NetworkConditions())
        self.client: Bus = self.network.join("client")

    def start(self, journal: Journal | None = None) -> InProcessBus:
        bus = self.network.join(RESOURCE_MANAGER)
        ResourceManagerNode(DOOR, journal=journal or Journal(None, IDENTITY), contended=True).attach(bus)
        return bus

    def run(self, seconds: float) -> None:
        self.network.run_for(seconds)

    def asked(self, message: Message, key: str) -> list[Answer]:
        answers: list[Answer] = []
        self.client.ask(key, encode(message), answers.append)
        self.run(0.2)
        return answers

    def state(self) -> str | None:
        """State of the lock, by the active resource manager; None without one."""
        for answer in self.asked(QueryStates(), KEYS.resource_states):
            if isinstance(answer, Answered):
                return decode(answer.payload, ResourceStates).states["lock"]
        return None

    def open(self) -> None:
        (answer,) = self.asked(FireExtern(resource="lock", target="OPEN", source="test"), KEYS.resource_extern)
        assert isinstance(answer, Answered)


def test_a_process_that_finds_a_leader_gives_way_and_logs_why(caplog: pytest.LogCaptureFixture) -> None:
    door = Door()
    leader = door.start()
    door.run(0.1)
    door.open()
    stray = door.start()
    door.run(1.0)
    assert (leader.closed, stray.closed) == (False, True)
    assert door.state() == "OPEN"
    assert "Another resource manager is active. End that one first" in caplog.text


def test_the_place_of_a_dead_one_is_taken_at_once() -> None:
    door = Door()
    leader = door.start()
    door.run(0.1)
    door.network.kill(leader)
    successor = door.start()
    door.run(0.5)
    assert not successor.closed
    assert door.state() == "SHUT"


def test_the_place_of_a_frozen_one_is_taken_within_its_lease_and_it_leaves_when_it_wakes_up() -> None:
    door = Door()
    leader = door.start()
    door.run(0.1)
    door.open()
    door.network.stop(leader)
    successor = door.start()
    door.run(3.0)
    assert door.state() == "SHUT", "another one, with a journal of its own"
    door.network.wake(leader)
    door.run(3.0)
    assert (leader.closed, successor.closed) == (True, False)
    assert door.state() == "SHUT"


def test_one_that_is_cut_off_ends_when_it_is_back_beside_its_successor() -> None:
    door = Door()
    leader = door.start()
    door.run(0.1)
    door.network.cut(leader)
    door.run(3.0)
    successor = door.start()
    door.run(3.0)
    door.network.reconnect(leader)
    door.run(3.0)
    assert (leader.closed, successor.closed) == (True, False)


@pytest.mark.parametrize("seed", range(60))
def test_of_those_that_start_at_the_same_moment_one_stays(seed: int) -> None:
    """Messages are slow, and some are lost."""
    door = Door(seed, NetworkConditions(latency=(0.0002, 0.2), loss=0.2))
    leaders = []
    for _ in range(3):
        leaders.append(door.start())
        door.run(seed % 7 * 0.01)
    door.run(PATIENCE)
    assert [leader.closed for leader in leaders].count(False) == 1
    door.network.conditions = NetworkConditions()
    assert door.state() == "SHUT"


def test_a_leader_that_leaves_refuses_until_it_has_left(tmp_path: Path) -> None:
    """A successor takes over the journal. The refusals of the old leader let it begin."""
    door = Door()
    path = tmp_path / "journal.sqlite"
    leader = door.start(Journal(path, IDENTITY))
    door.run(0.1)
    door.open()
    successor = door.start(Journal(path, IDENTITY))
    door.run(1.0)
    assert (leader.closed, successor.closed) == (True, False)
    assert door.state() == "OPEN"
