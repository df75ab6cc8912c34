"""What a command that runs a system does for whoever looks on: it has the run recorded, and opens a viewer."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from skillwing.services.errors import InvalidOptionError
from skillwing.services.history.files import TIMELINE_FILE
from skillwing.services.viewer.viewer import Viewer, ViewerKind

RecordOption = Annotated[
    bool, typer.Option("--record/--no-record", help="Write down all that happens, and a report of each mission.")
]
VIEWER_HELP = "Show the run in the Rerun viewer: in its window, or to a browser."
ViewerOption = Annotated[ViewerKind, typer.Option("--viewer", help=VIEWER_HELP)]


def check_observing(run_dir: Path, *, record: bool, viewer: ViewerKind, resume: bool = False) -> None:
    """Raise InvalidOptionError for a viewer of nothing, and for a directory with the recording of another run."""
    if viewer != "none" and not record:
        raise InvalidOptionError("viewer", "A viewer shows what is recorded. Leave out `--no-record`.")
    if record and not resume and (run_dir / TIMELINE_FILE).exists():
        text = f"{shown(run_dir)} holds the recording of a run already. Choose another directory, or `--no-record`."
        raise InvalidOptionError("run-dir", text)


def observing_words(*, record: bool, viewer: ViewerKind) -> list[str]:
    """These options as a command line says them."""
    return [*([] if record else ["--no-record"]), "--viewer", viewer]


@contextmanager
def opened_viewer(kind: ViewerKind, run_dir: Path, console: Console) -> Iterator[Viewer | None]:
    """A viewer of that kind; None for none, and with a sentence if it does not open."""
    if kind == "none":
        yield None
        return
    if kind == "native":
        console.print("Opening the viewer ...")
    with Viewer(kind, run_dir / "logs" / "viewer.log") as viewer:
        if not viewer.is_open:
            where = shown(viewer.log)
            console.print(f"The viewer did not open ({where} says why). The run is recorded all the same.", style="red")
        elif viewer.page is not None:
            console.print(f"Watch it in a browser: {viewer.page}", soft_wrap=True, highlight=False)
        yield viewer if viewer.is_open else None


def shown(path: Path) -> str:
    """A path as people write it: relative if it is below the working directory."""
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)
