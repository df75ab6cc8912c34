"""Replay: today's core gives the recorded answer to any event; a core with another rule does not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recorded_crane import CRANE, EVENTS, RecordedLife

from skillwing.dsl.model import DataItem
from skillwing.services.core import latest_data, readiness
from skillwing.services.core.events import Event, TimePassed
from skillwing.services.core.ledger import Ledger
from skillwing.services.core.resource_core import RULES
from skillwing.services.core.resource_table import ResourceTable
from skillwing.services.protocol import BeginGoal, DataSample, EndGoal, EndKind, FireExtern
from skillwing.services.replay.files import read_steps, step_files
from skillwing.services.replay.replaying import replay_folder
from skillwing.services.replay.steps import Taken

PAUSES = st.sampled_from([0.0, 0.0, 0.3, 1.0, 3.5])
DEEDS = st.one_of(st.tuples(EVENTS, PAUSES), st.sampled_from(["go_back", "come_back"]))


@settings(max_examples=40)
@given(deeds=st.lists(DEEDS, max_size=40), file_bytes=st.sampled_from([1, 3000, 1 << 20]))
def test_every_answer_is_as_it_was(deeds: list[Any], file_bytes: int) -> None:
    with TemporaryDirectory() as name:
        folder = Path(name) / "steps"
        life = RecordedLife(folder, file_bytes=file_bytes)
        for deed in deeds:
            if isinstance(deed, str):
                getattr(life, deed)()
            else:
                life.take([deed])
        life.writer.close()
        replayed = replay_folder(folder)
    assert replayed.divergence is None
    assert not replayed.unfinished


def begin(skill: str, goal: str, **inputs: object) -> BeginGoal:
    manager, schema = f"skill/{skill}", CRANE.schema_hash
    return BeginGoal(
        goal_id=goal, skill=skill, inputs=inputs, manager=manager, owner="t", schema=schema, incarnation="a"
    )


def datum(name: str, value: float, t: float) -> DataSample:
    return DataSample(name=name, value=value, t=t)


STORY: list[tuple[Event, float]] = [
    (datum("limit", 3.0, 0.0), 0.0),
    (datum("wind", 3.0, 0.0), 0.0),
    (begin("lift", "g1"), 1.0),
    (begin("lift", "g2"), 0.0),
    (begin("shine", "g3"), 0.0),
    (EndGoal(goal_id="g1", skill="lift", token=1000, how=EndKind.RESULT, result="STUCK"), 0.5),
    (begin("lift", "g4", load=5.0), 0.0),
    (begin("lift", "g5"), 0.0),
    (TimePassed(), 5.0),
    (begin("lift", "g6"), 0.0),
    (FireExtern(resource="power", target="OFF", source="grid"), 1.0),
    (FireExtern(resource="hook", target="TAKEN", source="grid"), 0.0),
]


def no_obstacle(*_words: object, **_options: object) -> None:
    return None


def never_false(*_words: object) -> None:
    return None


def fixed_token(self: Ledger, now: float) -> int:
    del self, now
    return 7


def for_ever(item: DataItem, stamp: float) -> float:
    del item, stamp
    return float("inf")


def forgets(self: Ledger, grant: Any) -> None:
    self._grants[grant.goal_id] = grant


@pytest.mark.parametrize(
    ("place", "name", "rule", "first"),
    [
        (ResourceTable, "obstacle", no_obstacle, 12),
        (readiness, "explain_failure", never_false, 4),
        (Ledger, "next_token", fixed_token, 3),
        (latest_data, "_fresh_until", for_ever, 9),
        (Ledger, "open", forgets, 3),
    ],
    ids=["transitions", "guards", "tokens", "staleness", "what is kept"],
)
def test_another_rule_shows_where_it_first_matters(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: Any, name: str, rule: Callable[..., Any], first: int
) -> None:
    life = RecordedLife(tmp_path)
    life.take(STORY)
    assert replay_folder(tmp_path).divergence is None
    monkeypatch.setattr(place, name, rule)
    found = replay_folder(tmp_path).divergence
    assert found is not None
    assert found.number == first
    assert found.differences


def test_a_new_file_begins_with_a_core_that_knows_everything(tmp_path: Path) -> None:
    life = RecordedLife(tmp_path, file_bytes=1)
    life.take(STORY)
    files = [read_steps(path) for path in step_files(tmp_path)]
    assert len(files) == len(STORY) + 1, "each step fills a file, and so does a core"
    assert all(file is not None and isinstance(file.lines[-1], Taken) for file in files[1:])
    assert replay_folder(tmp_path).divergence is None


def test_every_event_has_a_rule_and_a_tag_of_its_own() -> None:
    kinds = get_args(Event)
    assert set(RULES) == set(kinds)
    assert len({kind.__struct_config__.tag for kind in kinds}) == len(kinds)
