"""Common mistakes, put into sound skillset files: each with its expected code and place."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from skillwing.dsl.reading.dialect import lex
from skillwing.dsl.reading.lexemes import Lexeme

_COUNTED = frozenset({"SKILLSET", "SKILL", "RESOURCE", "DATA", "TYPE", "ENUM", "EVENT"})


@dataclass(frozen=True)
class Mistake:
    """Replacement of the text from `start` to `end`, and the expected `code`, `shift` characters behind `start`."""

    kind: str
    start: int
    end: int
    text: str
    code: str
    shift: int = 0

    @property
    def is_section(self) -> bool:
        """True if the skill may have this part only once."""
        return self.kind.startswith("misplaced")


def mistakes(text: str, file: str) -> list[Mistake]:
    """All mistakes that this module can make in a correct file, in file order."""
    words = [word for word in lex(text, file) if word.kind != "COMMENT"]
    found: list[Mistake] = []
    blocks: list[str] = []
    guard = ""
    for at in range(2, len(words) - 2):
        before, word = words[at - 1], words[at]
        if before.kind == "OPEN_PAREN" and words[at - 2].kind == "EQUALS":
            guard = words[at - 3].text
        if before.kind == "CLOSE_PAREN":
            guard = ""
        block = blocks[-1] if blocks else ""
        found += (*_of_names(words, at, block, guard), *_of_signs(words, at, guard), *_of_places(words, at, block))
        if word.kind == "OPEN":
            heading = words[at - 2] if words[at - 2].kind in _COUNTED and before.kind == "NAME" else before
            blocks.append("named effect" if heading.kind == "NAME" else heading.text)
        elif word.kind == "CLOSE":
            blocks.pop()
    return found


def _of_names(words: Sequence[Lexeme], at: int, block: str, guard: str) -> Iterator[Mistake]:
    before, word, behind = words[at - 1], words[at], words[at + 1]

    def instead(kind: str, code: str, text: str) -> Mistake:
        return Mistake(kind, word.start, word.end, text, code)

    is_name = word.kind == "NAME"
    if before.kind == "EQUALS" and words[at - 2].text in {"apply", "violation"}:
        yield instead("unknown effect", "SW012", "zzz")
    if before.text == "success" and block == "precondition" and is_name:
        yield instead("unknown effect", "SW012", "zzz")
    if guard == "resource" and is_name:
        if behind.kind == "COMPARATOR" and not word.text.isupper():
            yield instead("unknown resource", "SW010", "zzz")
        if before.kind == "COMPARATOR" and word.text.isupper():
            yield instead("unknown state", "SW011", "ZZZ")
    if guard == "data" and is_name and behind.kind in {"COMPARATOR", "DOT"} and before.kind != "DOT":
        yield instead("unknown datum", "SW014", "zzz")
    if before.kind == "COLON" and is_name and block in {"data", "input", "output"}:
        yield instead("unknown type", "SW013", "Zzz")
    if word.kind == "ARROW" and block in {"effect", "named effect"}:
        target = words[at + 1]
        yield Mistake("unknown state", target.start, target.end, "ZZZ", "SW011")
        yield Mistake("unknown resource", before.start, before.end, "zzz", "SW010")


def _of_signs(words: Sequence[Lexeme], at: int, guard: str) -> Iterator[Mistake]:
    word, behind = words[at], words[at + 1]
    if guard == "resource" and word.text == "==":
        yield Mistake("single equals sign", word.start, word.end, "=", "SW005")
    if word.kind == "COLON" and behind.kind in {"RESOURCE", "DATA"}:
        yield Mistake("no colon", word.start, word.end, " ", "SW005")
    misspelt = word.text[:-2] + word.text[-1]
    if behind.kind == "OPEN" and word.text in {"precondition", "invariant", "result", "effect"}:
        yield Mistake("misspelt section", word.start, word.end, misspelt, "SW003")
    if behind.kind == "NAME" and word.text in {"success", "failure"}:
        yield Mistake("misspelt mark", word.start, word.end, misspelt, "SW003")


def _of_places(words: Sequence[Lexeme], at: int, block: str) -> Iterator[Mistake]:
    before, word = words[at - 1], words[at]
    if before.kind == "CLOSE" and block == "skill":
        yield Mistake("stray section", word.start, word.start, "initial A ", "SW002")
        yield Mistake("stray guard", word.start, word.start, "guard resource=(a == B) ", "SW002")
        yield Mistake("comma", word.start, word.start, ", ", "SW004")
    if before.kind == "CLOSE" and block == "skillset":
        yield Mistake("stray section", word.start, word.start, "initial A ", "SW002")
        yield Mistake("section outside of a skill", word.start, word.start, "result { DONE } ", "SW002")
    if word.kind == "CLOSE" and block in {"input", "effect", "precondition", "result"}:
        yield Mistake("misplaced limit", word.start, word.start, " dispatch_timeout=4.0 ", "SW002", 1)
        yield Mistake("misplaced section", word.start, word.start, " lost { } ", "SW002", 1)
    if word.kind == "CLOSE" and block == "resource":
        yield Mistake("stray period", word.start, word.start, " period=4.0 ", "SW002", 1)
        yield Mistake("element in an element", word.start, word.start, " data { } ", "SW002", 1)


def with_mistakes(text: str, chosen: Iterable[Mistake]) -> tuple[str, list[tuple[str, int, int]]]:
    """Text with mistakes, and the expected code, line and column of each, in file order."""
    expected: list[tuple[str, int, int]] = []
    changed, at = "", 0
    for mistake in sorted(chosen, key=lambda each: each.start):
        changed += text[at : mistake.start]
        place = changed + mistake.text[: mistake.shift]
        expected.append((mistake.code, place.count("\n") + 1, len(place) - place.rfind("\n")))
        changed += mistake.text
        at = mistake.end
    return changed + text[at:], expected


def independent(text: str, known: Sequence[Mistake], chance: random.Random, count: int) -> list[Mistake]:
    """Up to `count` random mistakes, no two of them on neighbouring lines, and no section given twice."""
    chosen: list[Mistake] = []
    for mistake in chance.sample(known, len(known)):
        line = text.count("\n", 0, mistake.start)
        near = any(abs(line - text.count("\n", 0, other.start)) < 2 for other in chosen)
        again = mistake.is_section and mistake.text in {other.text for other in chosen}
        if not near and not again and len(chosen) < count:
            chosen.append(mistake)
    return chosen
