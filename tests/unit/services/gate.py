"""A skillset whose guards speak of everything they may: inputs, structures, what lasts, and names borne twice."""

from __future__ import annotations

from typing import Any

from rig import Bench

from skillwing.dsl import parse
from skillwing.services.protocol import GoalVerdict

GATE = parse(
    """
    skillset gate {
        type Point { x: float64  z: float64 }
        data {
            wind: float64 period=1.0
            load: float64 period=1.0
            at: Point period=1.0
            permit: float64
            heat: float64 period=1.0
            spare: float64 period=1.0
        }
        resource arm { initial FREE  FREE -> USED  USED -> FREE }
        resource flag {
            state { DOWN UP BROKEN }
            initial DOWN
            DOWN -> UP
            extern DOWN -> UP
            extern UP -> DOWN
            extern * -> BROKEN
            extern BROKEN -> DOWN
        }
        event gust { guard data=(wind > 9.0) effect { flag -> UP } }
        event calm { effect { flag -> DOWN } }

        skill lift {
            input {
                goal: Point
                load: float64 = 1.0   // a datum has this name, too,
                spare: float64 = 1.0  // and this one, which no guard speaks of,
                flag: bool = true     // and a resource this
            }
            effect { take: arm -> USED  release: arm -> FREE  warn: flag -> UP }
            precondition {
                near: data=(goal.z < 5.0)
                permitted: data=(permit > 0.0)
                light: data=(load < 9.0 and spare < 9.0)
                success take
                failure warn
            }
            invariant {
                below: data=(at.z < goal.x) violation=release
                small: data=(load < 8.0) violation=release
                plain: data=(flag) violation=release
            }
            interrupt { apply=release }
            result {
                success UP: apply=release post data=(heat < goal.x)
                failure HEAVY: apply=release
            }
        }

        skill weigh {
            effect { none {} }
            precondition { calm: data=(load < 9.0)  success none }
            result { WEIGHED: apply=none }
        }
    }
    """,
    "gate.skillset",
)


class Gate(Bench):
    """A resource core for it. fed: there is a value of each datum that allows everything."""

    def __init__(self, *, fed: bool = True) -> None:
        super().__init__(GATE)
        if fed:
            for name in ("wind", "load", "permit", "heat"):
                self.datum(name, 1.0)
            self.height(1.0)

    def height(self, z: float) -> None:
        self.datum("at", {"x": 0.0, "z": z})

    def lift(self, goal_id: str = "g", *, x: float = 3.0, z: float = 1.0, **inputs: Any) -> GoalVerdict:
        return self.begin("lift", goal_id, goal={"x": x, "z": z}, **inputs)
