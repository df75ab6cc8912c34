"""Where the skills of this drone may send it. Guidance enforces the whole fence; this is what is checked beforehand."""

from __future__ import annotations

HOME = (0.0, 0.0)
"""The home point: frames of the functional layer have their origin there (ENU, m)."""
CEILING = 30.0
"""Highest altitude above the home point [m]."""
