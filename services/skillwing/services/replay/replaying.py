"""Replay of recorded steps by the core as it is now, and comparison of the answers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

import msgspec

from skillwing.dsl import SkillsetError, parse
from skillwing.dsl.model import Skillset
from skillwing.services.core.events import Event
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.errors import BadRecordingError
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.replay.files import StepFile, read_steps, step_files
from skillwing.services.replay.steps import Head, Made, Taken, answer_of, encoded

NEW_RECORD = "a record that was not written then"
"""Id of a timeline record that the recorded answer does not have."""


@dataclass(frozen=True, slots=True)
class Difference:
    """A place where two answers differ, as a path into them, and both values; None for a missing one."""

    path: str
    then: Any
    now: Any


@dataclass(frozen=True, slots=True)
class Divergence:
    """The first step with another answer today.

    number: of the step, from 1, in its file. then, now: the answers as plain values.
    """

    file: Path
    number: int
    t: float
    event: Event
    then: dict[str, Any]
    now: dict[str, Any]

    @property
    def differences(self) -> tuple[Difference, ...]:
        return tuple(_differences("", self.then, self.now))


@dataclass(frozen=True, slots=True)
class Replayed:
    """Result of a replay. steps: number of those taken again; unfinished: files whose last line is not whole."""

    head: Head
    files: int
    steps: int
    begin: float
    end: float
    unfinished: tuple[Path, ...]
    divergence: Divergence | None


def replay_folder(folder: Path) -> Replayed:
    """Replay all files of steps in a directory, up to the first answer that differs. One file at a time is in memory.

    Raises BadRecordingError if there is nothing to replay, or if it cannot be replayed.
    """
    replayed: Replayed | None = None
    for path in step_files(folder):
        if (file := read_steps(path)) is not None and file.lines:
            replayed = _continued(replayed, file)
    if replayed is None:
        text = f"There are no steps of a resource manager in {folder}."
        raise BadRecordingError(f"{text} Name the directory of a run that `up`, `mock` or `demo` has made.")
    return replayed


def _continued(before: Replayed | None, file: StepFile) -> Replayed:
    """The replay with one more file. After a divergence it is counted, and not replayed."""
    known = before or Replayed(
        file.head, files=0, steps=0, begin=file.lines[0].t, end=0.0, unfinished=(), divergence=None
    )
    steps, divergence = known.steps, known.divergence
    if divergence is None:
        divergence = replay(file)
        taken = sum(isinstance(line, Taken) for line in file.lines)
        steps += taken if divergence is None else divergence.number
    return Replayed(
        known.head,
        files=known.files + 1,
        steps=steps,
        begin=known.begin,
        end=file.lines[-1].t,
        unfinished=known.unfinished if file.finished else (*known.unfinished, file.path),
        divergence=divergence,
    )


def replay(file: StepFile) -> Divergence | None:
    """Take the steps of one file again. Raises BadRecordingError if its skillset means something else today."""
    skillset = skillset_of(file)
    core: ResourceCore | None = None
    ids = _RecordIds()
    number = 0
    for line in file.lines:
        match line:
            case Made():
                core = _make_core(skillset, line, ids, core)
            case Taken() if core is not None:
                number += 1
                then = msgspec.msgpack.decode(line.answer)
                ids.give(then)
                answer = _answer(core, line)
                if answer != bytes(line.answer):
                    return Divergence(file.path, number, line.t, line.event, then, msgspec.msgpack.decode(answer))
            case _:
                pass
    return None


def skillset_of(file: StepFile) -> Skillset:
    """The recorded skillset. Raises BadRecordingError if this Skillwing reads its source as another one."""
    head = file.head
    try:
        skillset = parse(head.text, head.file)
    except SkillsetError as error:
        text = f"The skillset of {file.path} has errors today: {error.diagnostics[0].message}"
        raise BadRecordingError(f"{text.rstrip('.')}. Replay it with the version that recorded it.") from error
    if skillset.schema_hash != head.schema:
        then = f"{file.path} was written with version {head.schema} of the skillset `{head.skillset}`"
        text = f"{then}, whose source means version {skillset.schema_hash} to this Skillwing."
        raise BadRecordingError(f"{text} Replay it with the version that recorded it.")
    return skillset


class _RecordIds:
    """Source of record ids: timeline records get the ids of the recorded answer."""

    def __init__(self) -> None:
        self._ids: Iterator[str] = iter(())

    def give(self, answer: dict[str, Any]) -> None:
        """Use the ids of the records in this answer from now on."""
        self._ids = (each["id"] for each in answer.get("publications", ()) if "id" in each)

    def __call__(self) -> str:
        return next(self._ids, NEW_RECORD)


def _make_core(skillset: Skillset, made: Made, ids: _RecordIds, before: ResourceCore | None) -> ResourceCore:
    data = before.data if made.same_data and before is not None else None
    return ResourceCore(
        skillset, source=RESOURCE_MANAGER, new_record_id=ids, found=made.found, snapshot=made.snapshot, data=data
    )


def _answer(core: ResourceCore, taken: Taken) -> bytes:
    try:
        outcome = core.step(taken.event, taken.t)
    except Exception as error:  # noqa: BLE001 - any exception is an answer
        outcome = error
    return encoded(answer_of(outcome))


def _differences(path: str, then: Any, now: Any) -> Iterator[Difference]:
    match then, now:
        case dict(), dict():
            for key in {**then, **now}:
                inner = f"{path}.{key}" if path else str(key)
                yield from _differences(inner, then.get(key), now.get(key))
        case list(), list():
            for index, (one, other) in enumerate(zip_longest(then, now)):
                yield from _differences(f"{path}[{index}]", one, other)
        case _ if then != now or type(then) is not type(now):
            yield Difference(path, then, now)
        case _:
            pass
