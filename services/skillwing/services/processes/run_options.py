"""Options of a run from the environment, for processes that nobody starts with a command line: containers.

SKILLWING_SEED, SKILLWING_WORLD, SKILLWING_SPEED, SKILLWING_FAULTS and SKILLWING_LINK (both JSON), SKILLWING_SCENARIO (a
file), SKILLWING_RUN_DIR, SKILLWING_DURABLE (1 or 0), SKILLWING_VIEWER_URL. An empty one counts for nothing.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from skillwing.services.errors import InvalidOptionError

MAX_PACE = "max"
AS_FAST_AS_POSSIBLE = 0.0
SLOWEST = 0.05
LARGEST_SEED = 2**32 - 1
"""Of a simulated world; the least is 0."""


def pace(text: str | float) -> float:
    """Robot seconds per second, or AS_FAST_AS_POSSIBLE. Raises ValueError, whose text says what to give."""
    if str(text).strip().lower() == MAX_PACE:
        return AS_FAST_AS_POSSIBLE
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not SLOWEST <= found < math.inf:
        raise ValueError(f"give a number of {SLOWEST:g} or more, or `{MAX_PACE}`")
    return found


def seed(text: str) -> int:
    """Raises ValueError, whose text says what to give."""
    if not text.isdecimal() or len(text) > len(str(LARGEST_SEED)) or int(text) > LARGEST_SEED:
        raise ValueError(f"give a whole number from 0 to {LARGEST_SEED}")
    return int(text)


RUN_OPTIONS = {
    "seed": seed,
    "world": str,
    "speed": pace,
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
