"""Latest value of each datum, and its freshness."""

from __future__ import annotations

import pytest
from rig import RIG
from soundness import assert_all_sound, assert_sound

from skillwing.dsl import parse
from skillwing.services.core.data_core import DataCore
from skillwing.services.core.refusal import RefusedError
from skillwing.services.ids import RecordIds
from skillwing.services.protocol import DataReading, DataSample, ErrorCode, Record

LASTING = parse("skillset s { data { site: string  load: float64 period=0.1 } }", "s.skillset")


class Desk:
    """A data core with a clock, and what it has put on the timeline."""

    def __init__(self) -> None:
        self.core = DataCore(RIG, source="dm", new_record_id=RecordIds("dm"))
        self.records: list[Record] = []
        self.now = 0.0

    def take(self, records: tuple[Record, ...]) -> None:
        assert_all_sound(records, self.now)
        self.records += records

    def sample(self, value: object, t: float | None = None, name: str = "battery") -> None:
        self.take(self.core.update(DataSample(name=name, value=value, t=self.now if t is None else t), self.now))

    def wait(self, until: float) -> None:
        self.now = until
        self.take(self.core.tick(until))

    @property
    def reading(self) -> DataReading:
        reading = self.core.reading("battery", self.now)
        assert_sound(reading, self.now)
        return reading

    @property
    def story(self) -> list[tuple[float, str | None, str, str]]:
        assert all(record.subject == "battery" and record.source == "dm" for record in self.records)
        return [(record.t, record.before, record.after, record.text) for record in self.records]


def test_of_what_was_never_published_nothing_is_known() -> None:
    assert Desk().reading == DataReading(name="battery", value=None, t=None, age=None, stale=True)
    assert Desk().core.next_tick(0.0) is None


def test_a_value_has_an_age_and_turns_stale_after_three_periods() -> None:
    desk = Desk()
    desk.now = 5.0
    desk.sample(80.0)
    desk.wait(6.5)
    assert desk.reading == DataReading(name="battery", value=80.0, t=5.0, age=1.5, stale=False)
    assert desk.core.next_tick(desk.now) == 8.0
    desk.wait(7.999)
    assert not desk.reading.stale
    desk.wait(8.0)
    assert desk.reading == DataReading(name="battery", value=80.0, t=5.0, age=3.0, stale=True)
    assert desk.core.next_tick(desk.now) is None
    desk.wait(9.0)
    desk.sample(70.0)
    assert desk.story == [
        (5.0, "STALE", "FRESH", ""),
        (8.0, "FRESH", "STALE", "nothing new for 3.00 s"),
        (9.0, "STALE", "FRESH", ""),
    ]


def test_an_older_sample_and_one_from_the_future_change_little() -> None:
    desk = Desk()
    desk.now = 5.0
    desk.sample(80.0)
    desk.sample(60.0, t=4.0)
    assert desk.reading.value == 80.0
    desk.sample(50.0, t=99.0)
    assert desk.reading == DataReading(name="battery", value=50.0, t=5.0, age=0.0, stale=False)
    desk.sample(40.0, t=5.0)
    assert desk.reading.value == 40.0, "of two with one stamp the later counts"


def test_what_has_no_period_never_turns_stale() -> None:
    core = DataCore(LASTING, source="dm", new_record_id=RecordIds("dm"))
    core.update(DataSample(name="site", value="yard", t=0.0), 0.0)
    assert core.next_tick(0.0) is None
    assert not core.reading("site", 1e9).stale
    core.update(DataSample(name="load", value=1.0, t=0.0), 0.0)
    assert core.next_tick(0.0) == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("name", "value", "code"),
    [("battery", "full", ErrorCode.BAD_REQUEST), ("batery", 80.0, ErrorCode.UNKNOWN_NAME)],
)
def test_what_does_not_fit_is_refused_and_the_old_value_stays(name: str, value: object, code: ErrorCode) -> None:
    desk = Desk()
    desk.sample(80.0)
    with pytest.raises(RefusedError) as refusal:
        desk.sample(value, name=name)
    assert refusal.value.code is code
    assert "battery" in f"{refusal.value.message} {refusal.value.known}"
    assert desk.reading.value == 80.0


def test_a_reading_of_what_does_not_exist_is_refused_naming_what_does() -> None:
    with pytest.raises(RefusedError) as refusal:
        Desk().core.reading("batery", 0.0)
    assert (refusal.value.code, refusal.value.known) == (ErrorCode.UNKNOWN_NAME, ("battery",))
    assert "batery" in refusal.value.message
