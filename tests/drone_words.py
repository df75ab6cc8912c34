"""Words of a drone, which other robots never see."""

from __future__ import annotations

import re

DRONE_WORDS = re.compile(
    r"(?<![A-Za-z])(drones?|take[-_ ]?off|taking[-_ ]off|takes[-_ ]off|land|lands|landed|landing|flights?|fly|flies"
    r"|flying|flown|flew|airborne|buildings?|terrain|in[-_ ]the[-_ ]air)(?![A-Za-z])",
    re.IGNORECASE,
)
"""The words, also as parts of names with underscores: `LONGEST_FLIGHT`."""
