"""Keys of the M600's managers on the bus."""

from __future__ import annotations

from skillwing.m600.generated.processes import SKILLSET
from skillwing.services.protocol import Keys

KEYS = Keys(SKILLSET.stem)
