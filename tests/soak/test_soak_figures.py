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
from soak_figures import GROWTH_ALLOWED, HOUR, WEEK_GOALS, Sample, Soak, growths, not_judged, table, trend

BASE = 100e6


def samples(memory: Callable[[int], float], hours: float = 24.0, rate: float = 2.0) -> list[Sample]:
    """240 samples. memory: bytes of `recorder` by started goals."""
    times = [hours * HOUR * number / 240 for number in range(241)]
    return [Sample(t, {"recorder": round(memory(round(t * rate)))}, 2000, 1000, round(t * rate)) for t in times]


def soak(memory: Callable[[int], float], rate: float = 2.0) -> Soak:
    found = samples(memory, rate=rate)
    ended = found[-1].started
    return Soak(
        hours=24.0,
        rate=rate,
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
    measured = samples(lambda goals: BASE + leak * goals + chance.choice([0.0, 0.0, 60e6]))
    (found,) = growths(measured, HOUR)
    assert found.week == pytest.approx(leak * WEEK_GOALS / 1e6, rel=0.2, abs=0.1)
    assert found.risen == pytest.approx(leak * (measured[-1].started - measured[10].started) / 1e6, rel=0.2, abs=0.1)
    assert found.flat == (found.week < GROWTH_ALLOWED and found.risen < GROWTH_ALLOWED)


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


def test_a_leak_of_50_bytes_a_goal_is_a_problem_of_the_week() -> None:
    problem = "recorder grew by 8 MB in the soak, and grows by 30 MB in a week."
    assert soak(lambda goals: BASE + 50.0 * goals).problems() == [problem]


def test_a_leak_of_40_bytes_a_goal_is_a_problem_of_a_day_at_20_starts_a_second() -> None:
    problem = "recorder grew by 64 MB in the soak, and grows by 24 MB in a week."
    assert soak(lambda goals: BASE + 40.0 * goals, rate=20.0).problems() == [problem]


def test_a_process_that_is_between_two_lives_at_a_sample_is_judged_by_its_other_samples() -> None:
    found = samples(lambda goals: BASE + 100.0 * goals)
    for number in range(12, 240, 15):
        found[number] = replace(found[number], memory={})
    (growth,) = growths(found, HOUR)
    assert not growth.flat
    assert not_judged(found, HOUR) == []


def test_a_process_that_was_not_there_for_a_window_is_not_judged_which_the_table_says() -> None:
    whole = soak(lambda goals: BASE)
    for number in range(200, 215):
        whole.samples[number] = replace(whole.samples[number], memory={"driver": 60_000_000})
    assert [each.process for each in whole.growths] == []
    assert whole.not_judged == ["recorder", "driver"]
    for number, sample in enumerate(whole.samples):
        whole.samples[number] = replace(sample, memory={"router": 50_000_000, **sample.memory})
    text = table([whole])
    assert "Every process that was judged was flat." in text
    assert "Not judged, because they were not there all the time: recorder, driver." in text


def test_the_whole_run_directory_counts_on_the_disk() -> None:
    whole = soak(lambda goals: BASE)
    whole.samples[100] = replace(whole.samples[100], directory=1_101_000_000, parts=900_000_000)
    assert whole.problems() == ["The run directory has 1.1 GB, more than 1.1 times the 1 GB of `--keep`."]
    assert "The run directory had 1.1 GB at most, and the files that `--keep 1GB` limits 900 MB." in table([whole])


def test_a_recorder_that_was_too_busy_is_a_problem() -> None:
    whole = replace(soak(lambda goals: BASE), lost_events=3)
    assert whole.problems() == ["Busy processes lost 3 events."]
    assert "Busy processes lost 3 events." in table([whole])


def test_too_few_samples_have_no_trend() -> None:
    assert growths(samples(lambda goals: BASE)[:20], HOUR) == []
    assert trend([(1.0, 2.0), (1.0, 3.0)]) == 0.0


def test_an_interrupted_soak_is_in_the_table_with_what_it_measured() -> None:
    whole = soak(lambda goals: BASE)
    part = replace(whole, samples=whole.samples[:121], finished=False)
    text = table([part])
    assert "**12.0 robot hours at 2.0 starts a second**, of 24 hours at 2" in text
    assert "This soak was interrupted." in text
    assert "| recorder | 100.0 | 100.0 | 100.0 | +0.0 | +0.0 |" in text
    assert "interrupted" not in table([whole])
    assert table([replace(whole, samples=[])]) == ""


@dataclass
class Runner:
    runs: int = 0
    finishes: bool = True

    def run(self, asked: Soak, speed: float, hours: float, folder: Path, on_sample: Callable[[Soak], None]) -> Soak:
        del speed, hours, folder
        self.runs += 1
        done = replace(soak(lambda goals: BASE), rate=asked.rate, code=asked.code, finished=self.finishes)
        on_sample(done)
        return done


def test_a_finished_soak_does_not_run_again_and_an_interrupted_one_ends_the_command(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runner = Runner(finishes=False)
    monkeypatch.setattr(soak_run, "code_of_soak", lambda: "aaaaaaaaaaaa")  # takes a second each time
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
    monkeypatch.setattr(soak_run, "code_of_soak", lambda: "bbbbbbbbbbbb")
    assert soak_run.main(words) == 0
    assert runner.runs == 5
    assert capsys.readouterr().out.count("Code bbbbbbbbbbbb, a machine.") == 2


def test_a_result_with_the_figures_of_older_code_is_measured_again(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    runner = Runner()
    monkeypatch.setattr(soak_run, "run", runner.run)
    older = msgspec.to_builtins(soak(lambda goals: BASE))
    for sample in older["samples"]:
        del sample["directory"]
    (tmp_path / "24h-2.json").write_bytes(msgspec.json.encode(older))
    assert soak_run.main(["--hours", "24", "--rate", "2", "--results", str(tmp_path)]) == 0
    assert runner.runs == 1
