"""Options of a run from the environment, for processes that nobody starts with a command line: containers.

SKILLWING_SEED, SKILLWING_WORLD, SKILLWING_SPEED, SKILLWING_FAULTS and SKILLWING_LINK (both JSON), SKILLWING_SCENARIO (a
file), SKILLWING_RUN_DIR, SKILLWING_DURABLE (1 or 0), SKILLWING_VIEWER_URL. An empty one counts for nothing.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from skillwing.services.errors import InvalidOptionError

RUN_OPTIONS = {
    "seed": int,
    "world": str,
    "speed": float,
    "faults": json.loads,
    "link": json.loads,
    "scenario": str,
    "run_dir": str,
    "durable": int,
    "viewer_url": str,
}


def run_options(environment: Mapping[str, str]) -> dict[str, Any]:
    """The options of the run that SKILLWING_* variables give; raises InvalidOptionError for one that means nothing."""
    found: dict[str, Any] = {}
    for option, convert in RUN_OPTIONS.items():
        variable = f"SKILLWING_{option.upper()}"
        text = environment.get(variable)
        if text:
            try:
                found[option] = convert(text)
            except ValueError as error:
                raise InvalidOptionError(option, f"{variable} is `{text}`, which cannot be read: {error}.") from error
    return found
