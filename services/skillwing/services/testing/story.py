"""The story of a test: the text that a failed assertion shows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from skillwing.dsl.expressions import names_used
from skillwing.dsl.model import Skill
from skillwing.dsl.queries import guards_of, named_by
from skillwing.services.history.history import History
from skillwing.services.history.wording import headline
from skillwing.services.protocol import DataReading, Record
from skillwing.services.testing.fake_layer import FakeLayer

MOST_RECORDS = 40
MOST_REQUESTS = 10
LONGEST_VALUE = 120


def tell(
    history: History,
    *,
    now: float,
    goal_id: str | None,
    states: Mapping[str, str],
    readings: Iterable[DataReading],
    layer: FakeLayer | None,
) -> str:
    """The timeline with its causes, from the first record of a goal on or whole, and the states at `now`."""
    return "\n".join(
        [
            "What happened (robot time in s):",
            *_timeline(history, goal_id),
            f"How things stand at {now:.3f}:",
            *(f"    {name} {state}" for name, state in states.items()),
            *(f"    {_reading(reading)}" for reading in readings),
            *_layer(layer),
        ]
    )


def concerned(skill: Skill, states: Mapping[str, str], reading: Callable[[str], DataReading]) -> str:
    """`power OFF; load never received`: the states and data that a skill's guards and effects name."""
    data = sorted(name for guard in guards_of(skill) for name in names_used(guard, "data"))
    return "; ".join(
        [
            *(f"{name} {states.get(name, 'unknown')}" for name in sorted(named_by(skill))),
            *(_reading(reading(name)) for name in dict.fromkeys(data)),
        ]
    )


def _timeline(history: History, goal_id: str | None) -> list[str]:
    records = _from_goal_on(history.records, goal_id)
    left_out = len(records) - MOST_RECORDS
    shown = records[-MOST_RECORDS:]
    rows = [(f"{record.t:.4f}", record.subject, _change(record), _why(record, history)) for record in shown]
    widths = [max((len(row[column]) for row in rows), default=0) for column in range(3)]
    lines = [
        f"    {t:>{widths[0]}}  {subject:<{widths[1]}}  {change:<{widths[2]}}  {why}".rstrip()
        for t, subject, change, why in rows
    ]
    if left_out > 0:
        lines.insert(0, f"    ... {left_out} earlier changes")
    return lines or ["    nothing"]


def _from_goal_on(records: Sequence[Record], goal_id: str | None) -> Sequence[Record]:
    first = next((number for number, record in enumerate(records) if goal_id and record.goal_id == goal_id), 0)
    return records[first:]


def _change(record: Record) -> str:
    return f"{record.before} -> {record.after}" if record.before else record.after


def _why(record: Record, history: History) -> str:
    """The record's own text, then its cause."""
    causes = history.chain(record.id)[:-1]
    because = f"<- {headline(causes[-1])}" if causes else ""
    return "  ".join(part for part in (record.text, because) if part)


def _reading(reading: DataReading) -> str:
    if reading.t is None:
        return f"{reading.name} never received"
    age = "" if reading.age is None else f", {reading.age:.2f} s old"
    return f"{reading.name} = {_short(reading.value)}{age}{', stale' if reading.stale else ''}"


def _layer(layer: FakeLayer | None) -> list[str]:
    if layer is None or not (layer.requests or layer.publications):
        return []
    lines = ["What the functional layer got last:"]
    lines += [f"    {asked.t:.4f}  {asked.key}  {_short(asked.message)}" for asked in layer.requests[-MOST_REQUESTS:]]
    for key in dict.fromkeys(heard.key for heard in layer.publications):
        times = [heard.t for heard in layer.publications if heard.key == key]
        lines.append(f"    {times[-1]:.4f}  {key}  the latest of {len(times)} publications")
    return lines


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 3]}..."
