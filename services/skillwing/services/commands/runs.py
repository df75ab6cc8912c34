"""`skillwing runs`: the runs in `runs/`, and the deletion of old ones."""

from __future__ import annotations

import shutil
import time
from collections import Counter
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.text import Text

from skillwing.services.errors import InvalidOptionError, SkillwingError
from skillwing.services.history.recording_state import STATE_FILE
from skillwing.services.names import JOURNAL_FILE
from skillwing.services.processes.run_state import running_systems
from skillwing.services.recording.recording_lock import is_recorded
from skillwing.services.recording.run_facts import RUN_FILE
from skillwing.services.runs.pruning import RunLimits, runs_to_delete
from skillwing.services.runs.runs import RUNS_FOLDER, Run, find_runs
from skillwing.services.sizes import read_age, read_size, size_text
from skillwing.services.terminal.connection import JsonOption
from skillwing.services.terminal.output import make_console, print_json, print_table
from skillwing.services.terminal.run_directory import is_claimed

runs = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    help="List the runs in runs/, and delete old ones. See docs/operations.md.",
)


def _reader(read: Callable[[str], Any], what: str) -> Callable[[str], Any]:
    def parse(text: str) -> Any:
        try:
            return read(text)
        except ValueError as error:
            raise typer.BadParameter(f"`{text}` is no {what}: {error}.") from error

    return parse


@runs.command("list")
def list_runs(as_json: JsonOption = False) -> None:
    """List the runs in `runs/` of this folder: begin, length in robot time, size, robot, and the ends of missions.

    A run that is being written is marked as active. What was deleted of a run, or not recorded, is in a line below.

    Exit codes: 0 listed.
    """
    found = _runs()
    if as_json:
        print_json(found)
    elif not found:
        typer.echo("There are no runs in runs/ of this folder.")
    else:
        _print(found)


@runs.command("prune")
def prune(
    keep: Annotated[
        int | None,
        typer.Option("--keep", metavar="SIZE", parser=_reader(read_size, "size"), help="Keep so much, such as 10GB."),
    ] = None,
    older_than: Annotated[
        float | None,
        typer.Option(
            "--older-than", metavar="AGE", parser=_reader(read_age, "age"), help="Delete what is older, such as 30d."
        ),
    ] = None,
    count: Annotated[
        int | None, typer.Option("--count", metavar="N", min=0, help="Keep so many of the latest runs.")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show what would be deleted, and delete nothing.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Delete the oldest runs in `runs/` of this folder, by size, age or number.

    A run that is being written is never deleted. Runs elsewhere, named with --run-dir, are not looked at.

    Exit codes: 0 done, 1 a run could not be deleted, 2 no limit was given.
    """
    if keep is None and older_than is None and count is None:
        text = "Nothing says which runs to delete. Give --keep SIZE, --older-than AGE or --count N."
        raise InvalidOptionError("keep", text)
    oldest = None if older_than is None else time.time() - older_than
    chosen = runs_to_delete(_runs(), RunLimits(size=keep, count=count, oldest=oldest))
    failures = {} if dry_run else {run.path: failure for run in chosen if (failure := _delete(Path(run.path)))}
    gone = [run for run in chosen if run.path not in failures]
    if as_json:
        print_json({"deleted": not dry_run, "runs": gone})
    else:
        for run in gone:
            typer.echo(f"{run.path}  {size_text(run.size)}")
        did = "would be deleted" if dry_run else "deleted"
        typer.echo(f"{_counted(gone)} {did}, {size_text(sum(run.size for run in gone))}.")
    if failures:
        raise SkillwingError("\n".join(failures.values()))


def _runs() -> list[Run]:
    """The runs of this folder. A run is active while a system runs there, or its recorder writes."""
    systems = {Path(system.run_dir).resolve() for system in running_systems()}
    folder = RUNS_FOLDER
    recorded = {path.parent.resolve() for path in folder.glob(f"*/{STATE_FILE}") if is_recorded(path.parent)}
    claimed = {path.resolve() for path in folder.glob("*/") if is_claimed(path)}
    return find_runs(folder, systems | recorded | claimed)


def _delete(path: Path) -> str:
    """Delete a run; returns a sentence if that is not possible. What makes the folder a run goes last."""
    try:
        for entry in sorted(path.iterdir(), key=lambda each: each.name in (RUN_FILE, JOURNAL_FILE)):
            if entry.is_dir() and not entry.is_symlink():
                shutil.rmtree(entry)
            else:
                entry.unlink()
        path.rmdir()
    except OSError as error:
        return f"`{path}` cannot be deleted: {error.strerror}. Check its owner."
    return ""


def _print(found: list[Run]) -> None:
    console = make_console()
    rows = [
        (
            run.path + (" (active)" if run.active else ""),
            datetime.fromtimestamp(run.begun).astimezone().isoformat(sep=" ", timespec="minutes").partition("+")[0],
            "" if run.seconds is None else _duration(run.seconds),
            size_text(run.size),
            run.robot,
            _ends(run),
        )
        for run in found
    ]
    print_table(console, ("RUN", "BEGUN", "ROBOT TIME", "SIZE", "ROBOT", "MISSIONS"), rows)
    for run in found:
        for sentence in run.missing:
            console.print(Text(f"{run.path}: {sentence}", style="red"))
    console.print(f"{_counted(found)}, {size_text(sum(run.size for run in found))}.")


def _counted(found: list[Run]) -> str:
    return f"{len(found)} run{'' if len(found) == 1 else 's'}"


def _duration(seconds: float) -> str:
    hours, rest = divmod(round(seconds), 3600)
    return f"{hours}:{rest // 60:02}:{rest % 60:02}"


def _ends(run: Run) -> str:
    """Missions with their results; equal ones are counted."""
    counted = Counter((each.mission, each.result) for each in run.missions)
    return ", ".join(
        f"{mission} {result}" + (f" ({number} times)" if number > 1 else "")
        for (mission, result), number in counted.items()
    )
