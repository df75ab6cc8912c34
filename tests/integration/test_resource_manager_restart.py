"""Restarts of the resource manager in any state of a goal: no other process is restarted, and nothing is lost.

The tests run in one process and virtual time; test_resource_manager_killed.py does the same to real processes.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from skillwing.dsl import parse
from skillwing.services.bus import Answer, Answered, NoReply, Refused
from skillwing.services.bus.inprocess import InProcessBus, InProcessNetwork
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.client.retry import LONGEST_DELAY
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.ids import RecordIds
from skillwing.services.journal.errors import JournalUnreadableError, JournalWriteError
from skillwing.services.journal.journal import Journal, look_into
from skillwing.services.journal.schema import Identity
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.names import RESOURCE_MANAGER, skill_process
from skillwing.services.protocol import (
    BeginGoal,
    DataSample,
    ErrorCode,
    FireExtern,
    Keys,
    Message,
    ProtocolError,
    QueryStates,
    Record,
    ResourceStates,
    ResourceStep,
    State,
    Violated,
    decode,
    encode,
)
from skillwing.services.testing import SkillsetInProcess

DIGGER = parse(
    """
    skillset digger {
        data { slope: float64 [rad] period=0.5  permit: float64 }
        resource engine { initial ON  extern ON -> OFF  extern OFF -> ON }
        resource arm { initial FREE  FREE -> USED  USED -> FREE }
        skill dig {
            effect { take: arm -> USED  free: arm -> FREE }
            precondition { free: resource=(arm == FREE)  level: data=(slope < 0.5)  success take }
            invariant {
                engine: resource=(engine == ON) violation=free
                level: data=(slope < 0.5) violation=free
                permitted: data=(permit > 0.0) violation=free
            }
            interrupt { apply=free timeout=2.0 }
            result { success DONE: apply=free  failure ROCK: apply=free }
        }
    }
    """,
    "digger.skillset",
)
SKILL = skill_process("dig")


class Dig(SkillHooks[dict[str, Any], Any, Any]):
    """Digs until the test says otherwise."""

    skill = "dig"

    def on_dispatch(self, goal: Goal[dict[str, Any]]) -> None:
        pass

    def on_interrupt(self, goal: Goal[dict[str, Any]]) -> None:
        pass


@pytest.fixture
def digger() -> SkillsetInProcess:
    return SkillsetInProcess(DIGGER, [Dig], data={"slope": 0.1, "permit": 1.0})


def hooks(digger: SkillsetInProcess) -> Dig:
    found = digger.hooks["dig"]
    assert isinstance(found, Dig)
    return found


def die_and_come_back(digger: SkillsetInProcess, away: float = 0.5) -> None:
    digger.kill(RESOURCE_MANAGER)
    digger.run(away)
    digger.restart(RESOURCE_MANAGER)


def test_a_running_goal_runs_on_and_ends_as_if_nothing_had_happened(digger: SkillsetInProcess) -> None:
    goal = digger.start_skill("dig")
    die_and_come_back(digger)
    digger.run(5.0)
    assert goal.state is State.RUNNING
    digger.assert_states(arm="USED")
    hooks(digger).terminated(goal.id, "DONE", None)
    goal.assert_ended("S_DONE")
    digger.assert_states(arm="FREE")


def test_a_goal_that_ends_while_nobody_listens_ends_when_somebody_does(digger: SkillsetInProcess) -> None:
    goal = digger.start_skill("dig")
    digger.kill(RESOURCE_MANAGER)
    hooks(digger).terminated(goal.id, "DONE", None)
    digger.run(0.5)
    assert goal.state is State.RUNNING
    digger.restart(RESOURCE_MANAGER)
    goal.assert_ended("S_DONE")
    digger.assert_states(arm="FREE")


def test_a_start_while_nobody_listens_is_granted_when_somebody_does(digger: SkillsetInProcess) -> None:
    digger.kill(RESOURCE_MANAGER)
    goal = digger.send_start("dig")
    digger.run(0.5)
    assert goal.state is State.VALIDATING
    digger.restart(RESOURCE_MANAGER)
    digger.run(1.0)
    assert goal.state is State.RUNNING


@pytest.mark.parametrize("away", [7.0, 7.3, 7.6, 7.9])
def test_the_resources_of_a_goal_that_ended_without_an_answer_are_free_a_second_after_the_return(
    digger: SkillsetInProcess, away: float
) -> None:
    """The skill starts again as soon as its manager has repeated the end."""
    first = digger.start_skill("dig")
    digger.kill(RESOURCE_MANAGER)
    hooks(digger).terminated(first.id, "DONE", None)
    digger.run(away)
    first.assert_ended("ERROR")
    digger.restart(RESOURCE_MANAGER)
    refused = digger.send_start("dig")
    refused.assert_ended("NR")
    digger.assert_states(arm="USED")
    digger.run(LONGEST_DELAY)
    digger.assert_states(arm="FREE")
    assert digger.start_skill("dig").state is State.RUNNING


def test_an_invariant_that_broke_meanwhile_is_noticed(digger: SkillsetInProcess) -> None:
    goal = digger.start_skill("dig")
    digger.kill(RESOURCE_MANAGER)
    digger.set_data(slope=0.9)
    digger.run(0.5)
    digger.restart(RESOURCE_MANAGER)
    goal.assert_ended("RI", invariant="level")


def test_a_datum_that_stays_away_counts_for_as_long_as_it_would_have(digger: SkillsetInProcess) -> None:
    goal = digger.start_skill("dig")
    digger.kill(RESOURCE_MANAGER)
    digger.stop_data("slope")
    digger.kill("data_manager")
    digger.run(0.2)
    digger.restart(RESOURCE_MANAGER)
    digger.run(1.0)
    assert goal.state is State.RUNNING
    digger.run(1.0)
    goal.assert_ended("RI", invariant="level")


def test_a_manager_that_died_meanwhile_has_lost_its_goal(digger: SkillsetInProcess) -> None:
    digger.start_skill("dig")
    digger.kill(RESOURCE_MANAGER)
    digger.kill(SKILL)
    digger.run(0.2)
    digger.restart(RESOURCE_MANAGER)
    digger.assert_states(arm="USED")
    digger.run(1.5)
    digger.assert_states(arm="FREE")


def test_a_verdict_that_nobody_heard_is_said_again() -> None:
    """The process died after it had written the verdict to the journal, and before it could publish it."""
    journal = Journal(None, Identity("", DIGGER.name, DIGGER.schema_hash))
    core = ResourceCore(DIGGER, source=RESOURCE_MANAGER, new_record_id=RecordIds(RESOURCE_MANAGER))
    journal.write(core.initial_entries(), (), 0.0, 0)
    for name, value in (("slope", 0.1), ("permit", 1.0)):
        core.step(DataSample(name=name, value=value, t=0.0), 0.0)
    begin = BeginGoal(goal_id="g", skill="dig", inputs={}, manager=SKILL, owner="test", schema=DIGGER.schema_hash)
    for step in (
        core.step(begin, 0.0),
        core.step(FireExtern(resource="engine", target="OFF", source="test"), 0.0),
    ):
        journal.write(step.entries, [each for each in step.publications if isinstance(each, Record)], 0.0, step.number)

    network, keys = InProcessNetwork(), Keys(DIGGER.name)
    heard: list[Violated] = []
    records: list[Record] = []
    listener = network.bus("listener")
    listener.subscribe(keys.verdict("dig"), lambda sample: heard.append(decode(sample.payload, Violated)))
    follow_records(listener, keys, records.append)
    network.attach(ResourceManagerNode(DIGGER, journal=journal))
    network.run_for(0.1)
    assert [(verdict.goal_id, verdict.invariant) for verdict in heard] == [("g", "engine")]
    assert [record.after for record in records] == ["GRANTED", "USED", "OFF", "VIOLATED", "FREE", "RESUMED"]


@pytest.mark.parametrize(
    "key, request_",
    [
        (Keys(DIGGER.name).resource_extern, FireExtern(resource="engine", target="OFF", source="test")),
        (Keys(DIGGER.name).resource_states, QueryStates()),
    ],
    ids=["what would change something", "a question"],
)
def test_a_resource_manager_whose_journal_another_one_has_taken_ends(
    tmp_path: Path, key: str, request_: Message
) -> None:
    """The old process answers nothing from its state: the later one may have lost its goals, and granted others."""
    identity = Identity("", DIGGER.name, DIGGER.schema_hash)
    network, keys = InProcessNetwork(), Keys(DIGGER.name)
    network.attach(ResourceManagerNode(DIGGER, journal=Journal(tmp_path / "journal.sqlite", identity)))
    client = network.bus("client")
    alive: dict[str, bool] = {}
    client.watch_alive(keys.alive("**"), alive.__setitem__)
    network.run_for(0.1)
    Journal(tmp_path / "journal.sqlite", identity)
    answers: list[Answer] = []
    client.ask(key, encode(request_), answers.append)
    network.run_for(0.1)
    client.ask(key, encode(request_), answers.append)
    network.run_for(0.1)
    refused, unanswered = answers
    assert isinstance(refused, Refused)
    assert refused.error.code is ErrorCode.UNAVAILABLE
    assert "Another process goes on from the journal" in refused.error.message
    assert unanswered == NoReply(timed_out=False)
    assert alive == {keys.alive(RESOURCE_MANAGER): False}
    network.bus(RESOURCE_MANAGER).close()  # Its name is free, for it has left the network.


def test_a_resource_manager_that_cannot_read_what_it_wrote_ends(
    digger: SkillsetInProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The process would lead without knowing its grants. The next one reads them from the journal."""
    broken = JournalUnreadableError(Path("journal.sqlite"), "The journal cannot be read now: disk I/O error.")
    with monkeypatch.context() as disk:
        disk.setattr(Journal, "write", raising(JournalWriteError(Path("journal.sqlite"), "The disk fails.")))
        disk.setattr(Journal, "snapshot", raising(broken))
        digger.send_start("dig")
        with pytest.raises(JournalUnreadableError):
            digger.run(0.1)
    die_and_come_back(digger)
    digger.run(2.0)
    digger.assert_states(arm="USED")


def test_a_journal_of_an_earlier_life_of_the_robot_is_set_aside(tmp_path: Path) -> None:
    """Robot time has started again, as with a new simulated world: the states in the journal are out of date."""
    identity, path = Identity("", DIGGER.name, DIGGER.schema_hash), tmp_path / "journal.sqlite"
    core = ResourceCore(DIGGER, source=RESOURCE_MANAGER, new_record_id=RecordIds(RESOURCE_MANAGER))
    journal = Journal(path, identity)
    journal.write(core.initial_entries(), (), 0.0, 0)
    step = core.step(FireExtern(resource="engine", target="OFF", source="test"), 50.0)
    journal.write(step.entries, (), 50.0, step.number)
    journal.close()

    network, keys = InProcessNetwork(), Keys(DIGGER.name)
    network.attach(ResourceManagerNode(DIGGER, journal=Journal(path, identity)))
    states: list[Answer] = []
    network.run_for(0.1)
    network.bus("client").ask(keys.resource_states, encode(QueryStates()), states.append)
    network.run_for(0.1)
    (answer,) = states
    assert isinstance(answer, Answered)
    assert decode(answer.payload, ResourceStates).states["engine"] == "ON"
    _, kept = look_into(tmp_path / "journal-1.sqlite")
    assert {stands.resource: stands.state for stands in kept.resources}["engine"] == "OFF"


def test_tokens_and_steps_go_on_growing(digger: SkillsetInProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock stands still: tokens and step numbers grow only because the journal holds them."""
    monkeypatch.setattr(InProcessBus, "now", lambda _: 1.0)
    before = given_token(digger)
    number = published_step(digger)
    die_and_come_back(digger)
    assert published_step(digger) == number + 1, "its return is a step as well"
    assert given_token(digger) > before
    assert published_step(digger) > number + 1


def given_token(digger: SkillsetInProcess) -> int:
    """Run a goal to its end; returns the fencing token of its grant."""
    goal = digger.start_skill("dig")
    current = hooks(digger).current
    assert current is not None
    assert current.id == goal.id
    hooks(digger).terminated(goal.id, "DONE", None)
    goal.assert_ended("S_DONE")
    return current.token


def published_step(digger: SkillsetInProcess) -> int:
    answers: list[Answer] = []
    digger.bus.ask(Keys(DIGGER.name).resource_states, encode(QueryStates()), answers.append)
    digger.run(0.1)
    (answer,) = answers
    assert isinstance(answer, Answered)
    return decode(answer.payload, ResourceStates).step


def test_a_full_disk_refuses_requests_and_the_manager_lives(
    digger: SkillsetInProcess, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    goal = digger.start_skill("dig")
    full = JournalWriteError(Path("journal.sqlite"), "The journal cannot be written: the disk is full.")
    with monkeypatch.context() as disk:
        disk.setattr(Journal, "write", raising(full))
        with pytest.raises(RefusedError) as refusal:
            digger.trigger("engine", "OFF")
        assert refusal.value.code is ErrorCode.UNAVAILABLE
        assert "the disk is full" in refusal.value.message
        # No client repeats what a datum causes: the manager has to try until it can be written.
        digger.set_data(slope=0.9)
        digger.run(3.0)
        digger.assert_states(engine="ON", arm="USED")
        assert goal.state is State.RUNNING
    goal.assert_ended("RI", invariant="level", within=2.0)
    digger.trigger("engine", "OFF")
    digger.assert_states(engine="OFF", arm="FREE")
    complaints = [entry.getMessage() for entry in caplog.records if entry.name.endswith("journaled_core")]
    assert len(complaints) == 2, "one when it begins, one when it is over"


def test_a_manager_that_is_back_keeps_what_it_was_granted_meanwhile(
    digger: SkillsetInProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first goal's loss cannot be written at first. Meanwhile a new process of the manager runs another goal."""
    digger.start_skill("dig")
    digger.kill(SKILL)
    with monkeypatch.context() as disk:
        disk.setattr(Journal, "write", raising(JournalWriteError(Path("journal.sqlite"), "The disk is full.")))
        digger.run(1.5)
        digger.assert_states(arm="USED")
    digger.restart(SKILL)
    goal = digger.start_skill("dig")
    digger.run(3.0)
    assert goal.state is State.RUNNING


def test_a_loss_that_could_not_be_written_is_written_later(
    digger: SkillsetInProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    digger.start_skill("dig")
    digger.kill(SKILL)
    with monkeypatch.context() as disk:
        disk.setattr(Journal, "write", raising(JournalWriteError(Path("journal.sqlite"), "The disk is full.")))
        digger.run(5.0)
        digger.assert_states(arm="USED")
    digger.run(2.0)
    digger.assert_states(arm="FREE")


def test_a_step_that_cannot_be_sent_is_answered_and_its_states_are_asked_for(
    digger: SkillsetInProcess, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A step in the journal stands. A client that misses it sees no goal end before it knows the states."""

    def encode_no_step(message: Message) -> bytes:
        if isinstance(message, ResourceStep):
            raise ProtocolError("too long")
        return encode(message)

    monkeypatch.setattr("skillwing.services.managers.resource_manager.encode", encode_no_step)
    goal = digger.start_skill("dig")
    digger.trigger("engine", "OFF")
    goal.assert_ended("RI", invariant="engine")
    digger.assert_states(arm="FREE")
    assert "cannot send a ResourceStep" in caplog.text


def raising(error: Exception) -> Callable[..., None]:
    def write(*arguments: object) -> None:
        raise error

    return write
