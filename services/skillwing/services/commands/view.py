"""`skillwing view`: the recording of a run in the Rerun viewer."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Literal

import typer
from rich.console import Console

from skillwing.services.errors import SkillwingError
from skillwing.services.processes.stop_signal import stop_on_signals
from skillwing.services.recording.run_facts import missing_run_file
from skillwing.services.terminal.output import make_console
from skillwing.services.viewer.viewer import Viewer, has_screen, required_program

RECORDINGS = "recording*.rrd"
"""Recordings of a run. A recorder that restarts begins another file; the viewer shows them as one recording."""
CLOSE = "Close the viewer's window, or press Ctrl-C,"


def view(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="A run's directory, or a recording of it.", show_default=False)
    ],
    viewer: Annotated[
        Literal["native", "web"] | None,
        typer.Option(
            "--viewer",
            help="In a window, or in a browser. Default: a window, if there is a screen.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Open the recording of a run in the Rerun viewer until its window is closed, or until Ctrl-C. See
    docs/recordings.md.

    Exit codes: 0 shown, 1 the viewer did not open, 2 no such run, or one that was not recorded.
    """
    recordings = recordings_of(run)
    required_program()
    console = make_console()
    kind = viewer or ("native" if has_screen() else "web")
    # Ctrl-C is a normal way to close a viewer, not a failure.
    with suppress(KeyboardInterrupt), stop_on_signals() as stop, stop.raising():
        _show(kind, recordings, console)


def _show(kind: Literal["native", "web"], recordings: Sequence[Path], console: Console) -> None:
    with (
        TemporaryDirectory(prefix="skillwing-view-") as folder,
        Viewer(kind, Path(folder) / "viewer.log", recordings) as opened,
    ):
        if not opened.is_open:
            raise SkillwingError(_unopened(kind, opened.log))
        if opened.page is not None:
            console.print(f"Open it in a browser: {opened.page}", soft_wrap=True, highlight=False)
        console.print(f"{'Press Ctrl-C' if opened.page else CLOSE} to end.")
        opened.wait_until_closed()


def recordings_of(run: Path) -> tuple[Path, ...]:
    """The recordings of a run, oldest first, or the given recording. Raises InvalidOptionError."""
    if run.is_file() and run.suffix == ".rrd":
        return (run,)
    found = sorted(run.glob(RECORDINGS), key=lambda path: (len(path.name), path.name))
    if not found:
        raise missing_run_file(run, "recording.rrd")
    return tuple(found)


def _unopened(kind: Literal["native", "web"], log: Path) -> str:
    """The viewer's last line, and an alternative."""
    lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines() or ["none."]
    other = " `--viewer web` shows the run in a browser." if kind == "native" else ""
    return f"The viewer did not open.{other} Its last line: {lines[-1]}"
