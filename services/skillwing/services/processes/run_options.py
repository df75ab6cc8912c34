"""Options of a run from the environment, for processes without a command line: containers.

SKILLWING_SEED, SKILLWING_WORLD, SKILLWING_SPEED, SKILLWING_FAULTS and SKILLWING_LINK (both JSON), SKILLWING_SCENARIO (a
file), SKILLWING_RUN_DIR, SKILLWING_KEEP (such as 10GB), SKILLWING_DURABLE (1 or 0), SKILLWING_VIEWER_URL. An empty
variable has no effect.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from skillwing.services.errors import InvalidOptionError
from skillwing.services.sizes import read_size, size_text

MAX_SPEED = "max"
AS_FAST_AS_POSSIBLE = 0.0
SLOWEST = 0.05
LEAST_KEEP = 100_000_000
"""Least size of a run's files that can be asked for [bytes]."""
LARGEST_SEED = 2**32 - 1
"""Largest seed of a simulated world; the smallest is 0."""


def speed(text: str | float) -> float:
    """Robot seconds per second, or AS_FAST_AS_POSSIBLE. Raises ValueError with the accepted values."""
    if str(text).strip().lower() == MAX_SPEED:
        return AS_FAST_AS_POSSIBLE
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not SLOWEST <= found < math.inf:
        raise ValueError(f"give a number of {SLOWEST:g} or more, or `{MAX_SPEED}`")
    return found


def seed(text: str) -> int:
    """The seed of a world. Raises ValueError with the accepted values."""
    if not text.isdecimal() or len(text) > len(str(LARGEST_SEED)) or int(text) > LARGEST_SEED:
        raise ValueError(f"give a whole number from 0 to {LARGEST_SEED}")
    return int(text)


def keep(text: str) -> int:
    """The bytes that the files of a run may have. Raises ValueError with the accepted values."""
    size = read_size(text)
    if size < LEAST_KEEP:
        raise ValueError(f"give at least {size_text(LEAST_KEEP)}: the parts that are being written need some of it")
    return size


RUN_OPTIONS = {
    "seed": seed,
    "world": str,
    "speed": speed,
    "faults": json.loads,
    "link": json.loads,
    "scenario": str,
    "run_dir": str,
    "keep": keep,
    "durable": int,
    "viewer_url": str,
}


def run_options(environment: Mapping[str, str]) -> dict[str, Any]:
    """The options of the run in SKILLWING_* variables; raises InvalidOptionError for a value that cannot be read."""
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
