"""Criterion, table and results of the soak. `make soak` runs it."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec
import pytest
import soak_run
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace
from soak_figures import GROWTH_ALLOWED, HOUR, WEEK_GOALS, Sample, Soak, growths, table, trend

BASE = 100e6


def samples(memory: Callable[[int], float], hours: float = 24.0, rate: float = 2.0) -> list[Sample]:
    """240 samples. memory: bytes of `recorder` by started goals."""
    times = [hours * HOUR * number / 240 for number in range(241)]
    return [Sample(t, {"recorder": round(memory(round(t * rate)))}, 1000, round(t * rate)) for t in times]


def soak(memory: Callable[[int], float]) -> Soak:
    found = samples(memory)
    ended = found[-1].started
    return Soak(
        hours=24.0,
        rate=2.0,
        keep=1_000_000_000,
        settle=HOUR,
        machine="a machine",
        wall=1800.0,
        ended=ended,
        succeeded=ended,
        missions=90,
        samples=found,
        finished=True,
    )


@given(st.floats(1.0, 1000.0), st.randoms(use_true_random=False))
def test_a_leak_is_found_below_peaks_of_memory_that_are_not_one(leak: float, chance: random.Random) -> None:
    """leak: bytes for each goal."""
    (found,) = growths(samples(lambda goals: BASE + leak * goals + chance.choice([0.0, 0.0, 60e6])), HOUR)
    assert found.week == pytest.approx(leak * WEEK_GOALS / 1e6, rel=0.2, abs=0.1)
    assert found.flat == (found.week < GROWTH_ALLOWED)


@pytest.mark.parametrize(
    "memory",
    [
        lambda goals: BASE,
        lambda goals: BASE + 400.0 * (goals % 10_000),
        lambda goals: BASE + (12e6 if goals > 80_000 else 0.0),
        lambda goals: BASE + 100e6 * min(1.0, goals / 7000),
    ],
    ids=["constant", "saw-tooth", "one step", "a window that fills in the first hour"],
)
def test_what_does_not_grow_for_ever_is_flat(memory: Callable[[int], float]) -> None:
    assert soak(memory).problems() == []


def test_a_leak_of_50_bytes_a_goal_is_a_problem() -> None:
    assert soak(lambda goals: BASE + 50.0 * goals).problems() == ["recorder grows by 30 MB in a week."]


def test_a_process_that_was_not_there_all_the_time_has_no_trend() -> None:
    found = samples(lambda goals: BASE)
    found[200] = Sample(found[200].t, {}, 0, found[200].started)
    assert growths(found, HOUR) == []


def test_too_few_samples_have_no_trend() -> None:
    assert growths(samples(lambda goals: BASE)[:20], HOUR) == []
    assert trend([(1.0, 2.0), (1.0, 3.0)]) == 0.0


def test_an_interrupted_soak_is_in_the_table_with_what_it_measured() -> None:
    whole = soak(lambda goals: BASE)
    part = replace(whole, samples=whole.samples[:121], finished=False)
    text = table([part])
    assert "**12.0 robot hours at 2.0 starts a second**, of 24 hours at 2" in text
    assert "This soak was interrupted." in text
    assert "| recorder | 100.0 | 100.0 | 100.0 | +0.0 |" in text
    assert "interrupted" not in table([whole])
    assert table([replace(whole, samples=[])]) == ""


@dataclass
class Runner:
    runs: int = 0
    finishes: bool = True

    def run(self, asked: Soak, speed: float, hours: float, folder: Path, on_sample: Callable[[Soak], None]) -> Soak:
        del speed, hours, folder
        self.runs += 1
        done = replace(soak(lambda goals: BASE), rate=asked.rate, finished=self.finishes)
        on_sample(done)
        return done


def test_a_finished_soak_does_not_run_again_and_an_interrupted_one_ends_the_command(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runner = Runner(finishes=False)
    monkeypatch.setattr(soak_run, "run", runner.run)
    words = ["--hours", "24", "--rate", "2", "--hours", "2", "--rate", "20", "--results", str(tmp_path)]
    assert soak_run.main(words) == 1
    assert runner.runs == 1
    assert not msgspec.json.decode((tmp_path / "24h-2.json").read_bytes(), type=Soak).finished
    runner.finishes = True
    assert soak_run.main(words) == 0
    assert runner.runs == 3
    assert soak_run.main(words) == 0
    assert runner.runs == 3
    assert capsys.readouterr().out.count("Every process was flat.") == 5
