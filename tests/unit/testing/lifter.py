"""A small robot to test the kit on: a hoist that is told how high to go and reports where it is."""

from __future__ import annotations

import msgspec

from skillwing.dsl import parse
from skillwing.services.bus import Answer, Answered
from skillwing.services.bus.reading import message_reader
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.protocol import Message, Terminal, encode

LIFTER = parse(
    """
    skillset lifter {
        data { load: float64 [kg] period=0.5  height: float64 [m] period=0.1 }
        resource power {
            initial OFF
            extern OFF -> BOOTING
            extern BOOTING -> ON
            extern ON -> OFF
        }
        resource hoist { initial FREE  FREE -> USED  USED -> FREE }
        event blackout { guard resource=(power == ON) effect { power -> OFF } }
        skill lift {
            progress=0.5 { left: float64 [m] }
            input { height: float64 [m] in 0.0..9.0  speed: float64 [m/s] = 1.0 }
            output { height: float64 [m] }
            effect { take: hoist -> USED  release: hoist -> FREE }
            precondition {
                power: resource=(power == ON)
                free:  resource=(hoist == FREE)
                light: data=(load < 100.0)
                success take
            }
            invariant { power: resource=(power == ON) violation=release }
            interrupt { apply=release timeout=2.0 }
            result { success UP: apply=release  failure JAMMED: apply=release }
        }
        skill ring {
            effect { none {} }
            precondition { success none }
            result { RUNG: apply=none }
        }
    }
    """,
    "lifter.skillset",
)
COMMAND = "fl/hoist/command"
POSITION = "fl/hoist/position"
ENDED = "fl/hoist/ended"


class LiftInputs(msgspec.Struct, frozen=True, kw_only=True):
    height: float
    speed: float = 1.0


class LiftOutputs(msgspec.Struct, frozen=True, kw_only=True):
    height: float


class LiftFeedback(msgspec.Struct, frozen=True, kw_only=True):
    left: float


class Go(Message, frozen=True, kw_only=True):
    goal_id: str
    height: float


class Done(Message, frozen=True, kw_only=True):
    pass


class Position(Message, frozen=True, kw_only=True):
    height: float


class Lift(SkillHooks[LiftInputs, LiftOutputs, LiftFeedback]):
    """Asks the hoist to go, follows its position, and tells the layer how each goal ended."""

    skill = "lift"
    Inputs = LiftInputs
    Outputs = LiftOutputs
    Feedback = LiftFeedback

    def setup(self) -> None:
        self.height = 0.0
        self.ended = self.bus.advertise(ENDED, events=True)
        self.bus.subscribe(POSITION, message_reader(Position, self._on_position))

    def on_dispatch(self, goal: Goal[LiftInputs]) -> None:
        self._ask(goal, goal.inputs.height)

    def progress(self, goal: Goal[LiftInputs]) -> LiftFeedback:
        return LiftFeedback(left=goal.inputs.height - self.height)

    def on_ended(self, goal: Goal[LiftInputs], terminal: Terminal) -> None:
        self.ended.put(terminal.label.encode())

    def _ask(self, goal: Goal[LiftInputs], height: float) -> None:
        def answered(answer: Answer) -> None:
            if not isinstance(answer, Answered):
                self.terminated(goal.id, "JAMMED", LiftOutputs(height=self.height))

        self.bus.ask(COMMAND, encode(Go(goal_id=goal.id, height=height)), answered)

    def _on_position(self, position: Position) -> None:
        self.height = position.height
        if self.height < 0.0:
            raise ValueError("below the ground")
        if self.current is not None and self.height >= self.current.inputs.height:
            self.terminated(self.current.id, "UP", LiftOutputs(height=self.height))
