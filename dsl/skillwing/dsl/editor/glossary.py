"""What the words of each dialect mean, in a sentence or two of Markdown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from skillwing.dsl.editor.rl_glossary import RL_KEYWORDS
from skillwing.dsl.editor.skillset_glossary import OWNER_POLICIES, SKILLSET_KEYWORDS, SKILLSET_TYPES
from skillwing.dsl.reading.dialect import dialect_of


@dataclass(frozen=True, slots=True)
class Glossary:
    """Every keyword of a dialect, every type that is built in, and the choices that some keywords leave, by keyword."""

    keywords: Mapping[str, str]
    types: Mapping[str, str]
    choices: Mapping[str, Mapping[str, str]]

    def meaning(self, word: str, behind: str = "") -> str | None:
        """What a word means. behind: the keyword of which it may be a choice."""
        return self.choices.get(behind, {}).get(word) or self.keywords.get(word) or self.types.get(word)


_BY_GRAMMAR = {
    "skillset/skillset.lark": Glossary(SKILLSET_KEYWORDS, SKILLSET_TYPES, {"owner_lost": OWNER_POLICIES}),
    "rl/rl.lark": Glossary(RL_KEYWORDS, {}, {}),
}


def glossary_of(file: str) -> Glossary:
    """The glossary of the dialect in which a file of that name is written."""
    return _BY_GRAMMAR[dialect_of(file).grammar]
