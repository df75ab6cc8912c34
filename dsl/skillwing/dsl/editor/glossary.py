"""What the words of each dialect mean, in a sentence or two of Markdown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from skillwing.dsl.editor.rl_glossary import RL_KEYWORDS
from skillwing.dsl.editor.skillset_glossary import SKILLSET_KEYWORDS, SKILLSET_TYPES
from skillwing.dsl.reading.dialects import dialect_of


@dataclass(frozen=True, slots=True)
class Glossary:
    """Every keyword of a dialect, and every type that is built in, with its meaning."""

    keywords: Mapping[str, str]
    types: Mapping[str, str]

    def meaning(self, word: str) -> str | None:
        return self.keywords.get(word) or self.types.get(word)


_BY_GRAMMAR = {
    "skillset.lark": Glossary(SKILLSET_KEYWORDS, SKILLSET_TYPES),
    "rl.lark": Glossary(RL_KEYWORDS, {}),
}


def glossary_of(file: str) -> Glossary:
    """The glossary of the dialect in which a file of that name is written."""
    return _BY_GRAMMAR[dialect_of(file).grammar]
