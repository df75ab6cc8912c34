"""A goal from start to end as bytes: the messages between a client and the managers.

The real managers produce them on the in-process network, in virtual time, so that they are the same each time.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from skillwing.dsl import parse
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Answer
from skillwing.services.bus.inprocess import InProcessNetwork, SentMessage
from skillwing.services.mocking.script import MockRun, MockScript
from skillwing.services.mocking.system import make_mock_managers
from skillwing.services.protocol import FireExtern, InterruptGoal, Keys, Message, QueryStates, StartGoal, encode

DOOR = """\
skillset door {
    resource latch { initial SHUT  SHUT -> OPEN  OPEN -> SHUT }
    resource power { initial ON  extern ON -> OFF  extern OFF -> ON }
    skill open {
        progress=0.5 { reached: float64 [rad] }
        input  { angle: float64 [rad] in 0.1..1.5 = 1.0 }
        output { angle: float64 [rad] }
        effect { lift: latch -> OPEN  drop: latch -> SHUT }
        precondition { shut: resource=(latch == SHUT)  success lift }
        invariant { powered: resource=(power == ON) violation=drop }
        interrupt { apply=drop timeout=2.0 }
        result { success OPENED: apply=drop  failure STUCK: apply=drop }
    }
}
"""
CLIENT = "you"
FIRST_GOAL = "019ab3c4-5e6f-7a01-8b02-9c03ad04be05"
SECOND_GOAL = "019ab3c4-62d0-7b11-9c12-ad13be14cf15"
SCRIPT = MockScript(skills={"open": (MockRun(delay=0.7, output={"angle": 0.8}, progress={"reached": 0.4}),)})


@dataclass(frozen=True, slots=True)
class Said:
    """One message. who: `client` or the manager; how: `asks`, `replies`, `refuses` or `publishes`."""

    t: float
    who: str
    how: str
    key: str
    payload: bytes


HOW = {"ask": "asks", "reply": "replies", "refuse": "refuses", "put": "publishes"}


def door() -> Skillset:
    """The skillset of the exchange."""
    return parse(DOOR, "door.skillset")


def play() -> list[Said]:
    """The messages of a client that starts a goal that succeeds, and another one that loses its power."""
    skillset = door()
    keys = Keys(skillset.name)
    schema = skillset.schema_hash
    network = InProcessNetwork()
    said: list[Said] = []
    for node in make_mock_managers(skillset, SCRIPT):
        network.attach(node)
    client = network.bus(CLIENT)
    network.run_for(1.0)
    network.tap = lambda sent: said.extend(_heard(sent, keys))

    def ask(key: str, message: Message) -> None:
        answers: list[Answer] = []
        client.ask(key, encode(message), answers.append)
        network.run_until(lambda: bool(answers))

    ask(keys.resource_states, QueryStates())
    start = StartGoal(goal_id=FIRST_GOAL, inputs={"angle": 0.8}, client=CLIENT, schema=schema)
    ask(keys.start("open"), start)
    network.run_for(1.0)
    ask(keys.start("open"), StartGoal(goal_id=SECOND_GOAL, inputs={}, client=CLIENT, schema=schema))
    network.run_for(0.1)
    ask(keys.resource_extern, FireExtern(resource="power", target="OFF", source=CLIENT))
    network.run_for(0.1)
    ask(keys.interrupt("open"), InterruptGoal(goal_id=FIRST_GOAL, client=CLIENT))
    ask(keys.interrupt("open"), InterruptGoal(goal_id="a-goal-that-never-was", client=CLIENT))
    return said


def _heard(sent: SentMessage, keys: Keys) -> Iterable[Said]:
    """The message, if a client takes part in it. Managers also talk to each other."""
    public = {keys.resource_states, keys.resource_extern}
    public |= {keys.start("open"), keys.interrupt("open"), keys.status("open"), keys.progress("open")}
    public |= {keys.resource_steps}
    if sent.key in public:
        name = sent.source.name
        who = "client" if name == CLIENT else name
        yield Said(sent.t, who, HOW[sent.what], sent.key, sent.payload)
