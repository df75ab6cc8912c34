"""A flight that a run has recorded: east at a metre a second, along its route, with an obstacle on the way."""

from __future__ import annotations

from skillwing.onboard.topics.truth import Truth
from skillwing.services.protocol import Ending, GoalStatus, State, Terminal

ROUTE = ((0.0, 0.0, 4.0), (10.0, 0.0, 4.0))
BLOCKED = GoalStatus(
    goal_id="g",
    skill="goto",
    state=State.TERMINATED,
    t=4.0,
    terminal=Terminal(ending=Ending.SUCCEEDED, result="BLOCKED", reason="an obstacle is 3 m ahead"),
)


def truth(t: float, *, collisions: int = 0) -> Truth:
    return Truth(
        t=t,
        position=(t, 0.0, 4.0),
        quaternion=(1.0, 0.0, 0.0, 0.0),
        velocity=(1.0, 0.0, 0.0),
        collisions=collisions,
        clearance=3.0 - 0.1 * t,
        inside_fence=True,
    )
