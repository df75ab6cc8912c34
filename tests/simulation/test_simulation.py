"""Simulated managers keep their promises, and the simulation finds it when they do not."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from unittest.mock import patch

import pytest

from faulty_network import NetworkConditions
from simulation import report
from simulation.campaign import run_campaign, shrink
from simulation.found import FOUND
from simulation.ledger import Ledger, code_version, part_of, spans
from simulation.plan import FAULTS, Act, Deed, Plan, draw_plan
from simulation.planted import BUGS, LATE, SEEDS, find, planted
from simulation.run import Run, simulate
from simulation.story import tell
from skillwing.services.core import delivery

RUNS = 200
CHUNKS = 2


@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_promises_are_kept(chunk: int) -> None:
    """`make simulate SEED=...` shows the run of a failing seed."""
    runs = RUNS // CHUNKS
    campaign = run_campaign(chunk * runs, runs)
    assert not campaign.failures, campaign.text()


@pytest.mark.parametrize("name", FOUND)
def test_found_mistakes_stay_fixed(name: str) -> None:
    assert Run(FOUND[name]).carry_out().problems == ()


@pytest.mark.parametrize("bug", BUGS)
def test_simulation_finds_planted_bugs(bug: str) -> None:
    assert find(bug, LATE.get(bug, 0)) is not None, f"not within {SEEDS} seeds"


@pytest.mark.parametrize(("asked_for", "killed_at"), [("begin", 1.0), ("end", 1.15)])
def test_who_interrupts_without_a_resource_manager_waits_for_ten_silences(asked_for: str, killed_at: float) -> None:
    """The resource manager is away for longer than in drawn plans, from before the grant or after it."""
    goal = {"goal": "goal-1", "skill": "move"}
    acts = (
        Act(1.1, "mission", Deed.START, goal),
        Act(killed_at, "resource_manager", Deed.KILL, {"for": 8.0}),
        Act(1.2, "mission", Deed.INTERRUPT, goal),
    )
    plan = Plan(1, "exclusive", NetworkConditions(), True, tuple(sorted(acts, key=lambda act: act.t)))
    assert Run(plan).carry_out().problems == ()
    with patch.object(delivery, "SILENCES_UNTIL_ERROR", 11):
        [problem] = Run(plan).carry_out().problems
    assert problem.law == "waiting ends"
    assert f"asks for the {asked_for} of goal-1 for the 11th time" in problem.text


def test_plans_hold_every_kind_of_act_and_leave_some_robots_in_peace() -> None:
    plans = [draw_plan(seed) for seed in range(300)]
    assert {act.deed for plan in plans for act in plan.acts} == set(Deed)
    assert any(plan.calm for plan in plans)
    assert {plan.journal for plan in plans} == {True, False}


def test_a_seed_is_the_same_run_in_every_process() -> None:
    seed = next(seed for seed in range(100) if len({act.deed for act in draw_plan(seed).acts} & set(FAULTS)) > 1)
    code = f"from simulation.run import simulate; print(simulate({seed}).digest)"
    root = Path(__file__).parents[1]
    digests = {simulate(seed).digest}
    for hash_seed in ("1", "2"):
        environment = os.environ | {"PYTHONHASHSEED": hash_seed, "PYTHONPATH": str(root)}
        told = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        digests.add(told.stdout.strip())
    assert len(digests) == 1


def test_a_failing_plan_is_made_small_and_printed() -> None:
    bug = "the lost effect is skipped"
    found = find(bug)
    assert found is not None
    seed, law = found
    with planted(bug):
        plan = draw_plan(seed)
        small = shrink(plan)
        lines: list[str] = []
        outcome = tell(small, lines.append, messages=True)
    assert len(small.acts) < len(plan.acts)
    assert law in outcome.laws
    assert any("BROKEN" in line for line in lines)
    assert any("resource/goal" in line for line in lines)


def test_a_campaign_goes_on_where_it_was_interrupted(tmp_path: Path) -> None:
    file = tmp_path / "campaign.jsonl"
    for runs, code in ((2, "a"), (3, "a"), (1, "b")):
        ledger = Ledger(file)
        first = ledger.next_seed
        run_campaign(
            first, runs, on_part=lambda start, part, ledger=ledger, code=code: ledger.add(part_of(start, part, code))
        )
    parts = Ledger(file).parts
    assert [(part.first, part.end, part.code) for part in parts] == [(0, 2, "a"), (2, 5, "a"), (5, 6, "b")]
    assert spans(parts) == [(0, 5)]
    assert sum(part.messages for part in parts) == sum(simulate(seed).messages for seed in range(6))


def test_figures_take_the_place_of_those_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(report, "BUGS", ())
    page = tmp_path / "page.md"
    page.write_text(f"a\n{report.MARKS.begin}\n2,700 runs\n{report.MARKS.end}\nz\n", encoding="utf-8")
    part = part_of(0, run_campaign(0, 2), "a")
    report.write_section(page, [part])
    text = page.read_text(encoding="utf-8")
    assert "2,700" not in text
    assert f"2 runs (seeds 0 to 1) with {part.messages:,} messages" in text
    assert text.startswith("a\n")
    assert text.endswith("z\n")


def test_the_code_version_changes_with_the_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "extra.py"
    module = ModuleType("simulation.extra")
    module.__file__ = str(file)
    monkeypatch.setitem(sys.modules, module.__name__, module)
    file.write_text("A = 1")
    before = code_version()
    assert code_version() == before
    file.write_text("A = 2")
    assert code_version() != before
