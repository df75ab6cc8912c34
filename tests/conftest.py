from __future__ import annotations

from hypothesis import settings

# How long an example takes tells nothing where the machine does other work as well.
settings.register_profile("skillwing", deadline=None)
settings.load_profile("skillwing")
