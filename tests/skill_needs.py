"""Topics that skills use: by docs/functional-layer.md, and as observed."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from skillwing.services.names import skill_process

if TYPE_CHECKING:
    from observed_network import ObservedNetwork

PAGE = Path(__file__).parents[1] / "docs" / "functional-layer.md"
Needs = dict[str, tuple[set[str], set[str]]]
"""Keys by skill: those that it queries, and those that it follows."""


def told() -> Needs:
    """Table of the page."""
    chapter = PAGE.read_text(encoding="utf-8").partition("## What each skill needs")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| `(\w+)` \| (.*) \| (.*) \|$", chapter, re.MULTILINE)
    return {
        skill: (set(re.findall(r"fl/[\w/]+", asks)), set(re.findall(r"fl/[\w/]+", follows)))
        for skill, asks, follows in rows
    }


def seen(network: ObservedNetwork, skills: Iterable[str]) -> Needs:
    """Observed needs of these skills."""
    return {
        skill: (
            {key for key, who in network.asks.items() if key.startswith("fl/") and skill_process(skill) in who},
            {key for key, who in network.uses.items() if key.startswith("fl/") and skill_process(skill) in who},
        )
        for skill in skills
    }
