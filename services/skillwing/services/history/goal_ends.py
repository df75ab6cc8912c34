"""The latest goals of a run, and the ends of goals whose managers exited before they published them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from skillwing.services.errors import BadRecordingError
from skillwing.services.history.files import GOALS_FILE, last_parts
from skillwing.services.protocol import Ending, GoalStatus, Record, RecordKind, State, Terminal


def status_of_loss(record: Record) -> GoalStatus | None:
    """The last status of a goal from the record of its loss; None for any other record."""
    if record.kind is not RecordKind.GOAL or record.after != Ending.LOST or record.goal_id is None:
        return None
    return GoalStatus(
        goal_id=record.goal_id,
        skill=record.subject,
        state=State.TERMINATED,
        t=record.t,
        terminal=Terminal(ending=Ending.LOST, reason=record.text, detected_by=record.source),
        record=record.id,
        source=record.source,
        before=record.before,
        text=record.text,
        cause=record.cause,
    )


def was_lost(status: GoalStatus) -> bool:
    """True for the loss of a goal. Only a goal with a grant is lost."""
    return status.terminal is not None and status.terminal.ending is Ending.LOST


def latest_goals(statuses: Iterable[GoalStatus]) -> dict[str, GoalStatus]:
    """The latest status of each skill's goal. A goal that was refused as BUSY is no later one."""
    busy = Ending.BUSY
    return {each.skill: each for each in statuses if each.terminal is None or each.terminal.ending is not busy}


def recorded_goals(run_dir: Path | None) -> dict[str, GoalStatus]:
    """The same from the recording of a run; empty without a run directory or a readable recording.

    The last part is enough: its head has the latest goal of each skill.
    """
    try:
        return {} if run_dir is None else latest_goals(last_parts(run_dir, GOALS_FILE, GoalStatus))
    except (OSError, BadRecordingError):
        return {}
