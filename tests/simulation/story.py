"""A run as people read it: what was planned, every message and what became of it, and the timeline."""

from __future__ import annotations

from collections.abc import Callable

import msgspec

from simulation.plan import Plan
from simulation.run import Outcome, Run
from skillwing.services.bus.inprocess import SentMessage

_LEFT_OUT = ("v", "schema", "inputs", "t", "incarnation", "record", "cause")


def tell(plan: Plan, say: Callable[[str], None], *, messages: bool = False) -> Outcome:
    """Carry out a plan and tell what happens, line by line. messages: also each message."""
    say(f"seed {plan.seed}: skillset {plan.skillset}, journal {'on' if plan.journal else 'off'}, {plan.conditions}")
    for act in plan.acts:
        say(f"  plan {act}")
    run = Run(plan, (lambda said: say(_line(said))) if messages else None)
    if messages:
        run.world.network.on_fate = lambda fate: say(f"{run.world.network.now():8.4f}  ... {fate}")
    outcome = run.carry_out()
    say("timeline:")
    for record in run.observer.records.values():
        change = f"{record.before or '-'} -> {record.after}"
        cause = f" (of {record.cause})" if record.cause else ""
        say(f"{record.t:8.4f}  {record.id:24} {record.subject:16} {change} {record.goal_id or ''} {record.text}{cause}")
    for problem in outcome.problems:
        say(f"BROKEN {problem}")
    if not outcome.problems:
        say("all promises kept")
    return outcome


def _line(said: SentMessage) -> str:
    fields = msgspec.msgpack.decode(said.payload)
    told = " ".join(f"{name}={value}" for name, value in fields.items() if name not in _LEFT_OUT and value is not None)
    return f"{said.t:8.4f}  {said.source.name:20} {said.what:6} {said.key.partition('/')[2]:24} {told}"
