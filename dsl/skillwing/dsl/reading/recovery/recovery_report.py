"""What going on behind mistakes cost: what else is said of the file must not follow from that alone."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.spans import Span


@dataclass(slots=True)
class Losses:
    """What was not read, or not as it is written.

    words: those that were passed over; a name that seems unknown may be declared there. nameless: the keywords of the
    blocks that got no name, or that hold something without one. guessed: where a statement was read otherwise than it
    is written.
    """

    words: set[str] = field(default_factory=set[str])
    nameless: set[str] = field(default_factory=set[str])
    guessed: list[Span] = field(default_factory=list[Span])

    def pass_over(self, lexemes: Iterable[Lexeme]) -> None:
        for lexeme in lexemes:
            self.words.update(re.findall(r"\w+", lexeme.text))  # a comment that is never closed has many
