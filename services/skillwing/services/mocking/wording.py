"""The plan of a mock in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from skillwing.services.mocking.script import DEFAULT_DELAY
from skillwing.services.protocol import MockPlan


def plan_texts(plan: MockPlan) -> tuple[str, str]:
    """Runs of a skill's next goal and of later ones."""
    script = [run_text(run) for run in plan.script]
    if plan.drawn:
        total = sum(_weight(run) for run in plan.script)
        shares = [f"{_weight(run) / total:.0%} {text}" for run, text in zip(plan.script, script, strict=True)]
        rest = ["; ".join(shares)]
    else:
        rest = script
    [first, *then] = [*(run_text(run) for run in plan.given), *rest]
    if plan.drawn and not then:
        return first, "the same draw"
    return first, ", then ".join(then) or "the same"


def run_text(run: Mapping[str, Any]) -> str:
    """One run: `BLOCKED after 0.2 s`."""
    delay = run.get("delay", DEFAULT_DELAY)
    after = f"after {_delay(delay)}"
    match run:
        case {"invalid": text}:
            return f"NV ({text})"
        case {"error": text}:
            return f"ERROR ({text}) {after}"
        case {"hang": True}:
            return f"hangs {after}"
        case {"crash": True}:
            return f"crashes {after}"
        case {"result": result}:
            return f"{result} {after}"
        case _:
            return "runs until interrupted"


def _weight(run: Mapping[str, Any]) -> float:
    return float(run.get("weight", 1.0))


def _delay(delay: Any) -> str:
    match delay:
        case {"input": name}:
            return f"`{name}` seconds"
        case int() | float():
            return f"{_number(delay)} s"
        case _:
            low, high = delay
            return f"{_number(low)} to {_number(high)} s"


def _number(value: float) -> str:
    return f"{value:g}"
