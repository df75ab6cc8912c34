"""`skillwing replay`: a run's requests to the resource manager, answered again by the present code."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import msgspec
import typer
from rich.console import Console
from rich.text import Text

from skillwing.services.history.wording import time_text
from skillwing.services.names import STEPS_FOLDER
from skillwing.services.recording.run_facts import missing_run_file
from skillwing.services.replay.replaying import Divergence, Replayed, replay_folder
from skillwing.services.replay.wording import answer_in_words, event_in_words
from skillwing.services.terminal.connection import JsonOption
from skillwing.services.terminal.exit_codes import FAILED
from skillwing.services.terminal.output import make_console, print_json, value_text

DIFFERENCES_SHOWN = 6
LONGEST_VALUE = 70
"""Characters of a value in the output; `--json` has all of it."""


def replay(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run's directory.", show_default=False)],
    as_json: JsonOption = False,
) -> None:
    """Repeat a run's requests to the resource manager with the present code, and compare the answers. See
    docs/recordings.md.

     It needs no running system. The skillset is that of the run, which has a copy of its source.

     Exit codes: 0 every answer is the same, 1 one is not, 2 no such run, or one that cannot be replayed.
    """
    if not (run / STEPS_FOLDER).is_dir():
        raise missing_run_file(run, STEPS_FOLDER)
    replayed = replay_folder(run / STEPS_FOLDER)
    if as_json:
        print_json(_facts(replayed))
    else:
        _print(make_console(), replayed)
    if replayed.divergence is not None:
        raise typer.Exit(FAILED)


def _facts(replayed: Replayed) -> dict[str, Any]:
    found = replayed.divergence
    return {
        "robot": replayed.head.robot,
        "skillset": replayed.head.skillset,
        "schema": replayed.head.schema,
        "same": found is None,
        "steps": replayed.steps,
        "files": replayed.files,
        "unfinished": [str(path) for path in replayed.unfinished],
        "begin": replayed.begin,
        "end": replayed.end,
        "divergence": None
        if found is None
        else {
            "file": str(found.file),
            "number": found.number,
            "t": found.t,
            "event": msgspec.to_builtins(found.event),
            "then": found.then,
            "now": found.now,
            "differences": [{"path": each.path, "then": each.then, "now": each.now} for each in found.differences],
        },
    }


def _print(console: Console, replayed: Replayed) -> None:
    for path in replayed.unfinished:
        console.print(f"The last step in {path} was not written to its end, and is left out.")
    name = replayed.head.robot or replayed.head.skillset
    count = f"{replayed.steps} step{'' if replayed.steps == 1 else 's'}"
    if replayed.divergence is None:
        span = f"from {time_text(replayed.begin)} to {time_text(replayed.end)}"
        console.print(Text("same", style="bold green"), f"  {count} of {name}, {span}: every answer is as it was.")
    else:
        _print_divergence(console, replayed.divergence, count, name)


def _print_divergence(console: Console, found: Divergence, count: str, name: str) -> None:
    where = f"the last of {count} of {name} that were taken again, step {found.number} of {found.file}."
    console.print(Text("diverges", style="bold red"), f"  at {time_text(found.t)}: {where}")
    console.print(f"event  {event_in_words(found.event)}")
    console.print(f"then   {answer_in_words(found.then)}")
    console.print(f"now    {answer_in_words(found.now)}")
    differences = found.differences
    console.print()
    for each in differences[:DIFFERENCES_SHOWN]:
        console.print(f"{each.path}: {_short(each.then)} then, {_short(each.now)} now")
    if len(differences) > DIFFERENCES_SHOWN:
        console.print(f"... and {len(differences) - DIFFERENCES_SHOWN} more; --json has all of them.")


def _short(value: Any) -> str:
    text = value_text(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 3]}..."
