"""Options of the recorder, and the factories that they name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import msgspec

from skillwing.services.errors import InvalidOptionError
from skillwing.services.options import imported
from skillwing.services.recording.retention import KEEP


class RecorderOptions(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Options of the recorder. run_dir: directory of all its files. skillset: path of the `.skillset` file.

    scene: `"module:factory"` of the robot's part of the dashboard. collectors: `"module:factory"` of each further
    writer into the run directory. viewer: `none`; `spawn` a window on this machine; `serve` the run to viewers that
    connect to `bind`:`port`; `connect` to the viewer or server at `url`. keep: bytes that the files of the run may
    have; older parts are deleted.
    """

    run_dir: str
    skillset: str
    name: str = "recorder"
    scene: str | None = None
    scene_options: dict[str, Any] = {}
    collectors: tuple[str, ...] = ()
    viewer: Literal["none", "spawn", "serve", "connect"] = "none"
    bind: str = "127.0.0.1"
    port: int = 9876
    url: str = "rerun+http://127.0.0.1:9876/proxy"
    recording_id: str | None = None
    keep: int = KEEP


def read_options(options: dict[str, Any]) -> RecorderOptions:
    """Check the options of a recorder. Raises InvalidOptionError."""
    try:
        return msgspec.convert(options, RecorderOptions)
    except msgspec.ValidationError as error:
        known = ", ".join(RecorderOptions.__struct_fields__)
        text = f"These options do not fit a recorder: {error}. Its options: {known}."
        raise InvalidOptionError("recorder", text) from error


def part(reference: str) -> Callable[..., Any]:
    """The factory that `"package.module:function"` names. Raises InvalidOptionError."""
    return imported({"part": reference}, "part")
