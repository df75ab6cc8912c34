"""What a recorder can be told, and how it finds the parts that are named to it."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

import msgspec


class RecorderOptions(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """run_dir: where everything is written. skillset: path of the `.skillset` file.

    scene: `"module:factory"` of the robot's part of the dashboard; collectors: `"module:factory"` of whatever else
    writes into the run directory. viewer: `none`; `spawn` a window on this machine; `serve` the run to viewers that
    connect to `bind`:`port`; `connect` to the viewer or server at `url`.
    """

    run_dir: str
    skillset: str
    name: str = "recorder"
    scene: str | None = None
    scene_options: dict[str, Any] = {}
    collectors: tuple[str, ...] = ()
    viewer: str = "none"
    bind: str = "127.0.0.1"
    port: int = 9876
    url: str = "rerun+http://127.0.0.1:9876/proxy"
    recording_id: str | None = None


def named(reference: str) -> Callable[..., Any]:
    """The function that `"package.module:function"` names."""
    module, _, function = reference.partition(":")
    return getattr(importlib.import_module(module), function)
