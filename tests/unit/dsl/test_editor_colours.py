"""The TextMate grammars of the VS Code extension colour what the parser reads.

The patterns keep to what Oniguruma and Python's `re` have in common, and all but block comments are single matches. A
few lines do here what an editor does: the earliest match colours, by the first pattern among those that match there.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from editor_files import FILES, RL_FILES, document

from skillwing.dsl.editor.document import Document
from skillwing.dsl.reading.dialect import dialect_of
from skillwing.dsl.reading.lexemes import COMMENT

EXTENSION = Path(__file__).parents[3] / "editors" / "vscode"
DIALECTS = ["skillset", "rl"]
WORD_SCOPES = ("keyword.", "storage.type", "constant.language")


@dataclass(frozen=True, eq=False)
class Rule:
    """scopes: by number of the group they colour; 0 is the whole match."""

    pattern: re.Pattern[str]
    scopes: dict[int, str]


@cache
def rules(dialect: str) -> tuple[Rule, ...]:
    grammar = json.loads((EXTENSION / "syntaxes" / f"{dialect}.tmLanguage.json").read_text())
    return tuple(
        _rule(pattern)
        for include in grammar["patterns"]
        for pattern in grammar["repository"][include["include"].removeprefix("#")]["patterns"]
    )


def _rule(pattern: dict[str, Any]) -> Rule:
    if "begin" in pattern:
        return Rule(re.compile(f"{pattern['begin']}(?s:.*?){pattern['end']}"), {0: pattern["name"]})
    captures = {int(group): capture["name"] for group, capture in pattern.get("captures", {}).items()}
    return Rule(re.compile(pattern["match"], re.MULTILINE), captures or {0: pattern["name"]})


@cache
def coloured(text: str, dialect: str) -> dict[int, str]:
    """The scope of every character that has one, by offset."""
    return {offset: scope for start, end, scope in _coloured(text, dialect) for offset in range(start, end)}


def _coloured(text: str, dialect: str) -> Iterator[tuple[int, int, str]]:
    at = 0
    ahead = {rule: rule.pattern.search(text) for rule in rules(dialect)}
    while True:
        for rule, match in ahead.items():
            if match is not None and match.start() < at:
                ahead[rule] = rule.pattern.search(text, at)
        found = [(match.start(), rule, match) for rule, match in ahead.items() if match is not None]
        if not found:
            return
        _, rule, first = min(found, key=lambda candidate: candidate[0])
        yield from ((*first.span(group), scope) for group, scope in rule.scopes.items() if first[group] is not None)
        at = max(first.end(), at + 1)


@pytest.mark.parametrize("path", [*FILES, *RL_FILES], ids=lambda path: path.name)
def test_each_word_has_the_colour_of_what_it_is(path: Path) -> None:
    found = document(path)
    scopes = coloured(found.text, path.suffix[1:])
    names = {occurrence.start for occurrence in found.names.occurrences}
    for lexeme in found.lexemes:
        scope = scopes.get(lexeme.start, "")
        where = f"{lexeme.text!r} at {lexeme.span} is {scope!r}"
        if lexeme.kind == COMMENT:
            assert scope.startswith("comment."), where
        elif lexeme.start in names and lexeme.kind != "NAME":
            pass  # a word of the language as a name: that only the server can tell
        elif lexeme.start in names:
            assert not scope.startswith((*WORD_SCOPES, "comment", "string", "constant")), where
        elif dialect_of(path.name).vocabulary.is_word(lexeme.kind):
            assert scope.startswith(WORD_SCOPES), where
        elif lexeme.kind in {"NUMBER", "STRING"}:
            assert scope.startswith(("constant.numeric", "string.quoted")), where


def test_the_m600_is_coloured_sensibly() -> None:
    found = document(next(path for path in FILES if path.name == "m600.skillset"))
    scopes = coloured(found.text, "skillset")

    def scope(before: str, word: str) -> str:
        return scopes[found.text.index(before + word) + len(before)].removesuffix(".skillset")

    assert scope("", "skillset m600") == "storage.type"
    assert scope("skillset ", "m600") == "entity.name.namespace"
    assert scope("resource ", "SDK_authority") == "entity.name.type"
    assert scope("initial ", "UNAVAILABLE") == "variable.other.enummember"
    assert scope("skill ", "takeoff") == "entity.name.function"
    assert scope("target: ", "Position") == "entity.name.type"
    assert scope("height: ", "float64") == "support.type.primitive"
    assert scope("float64 ", "[m]") == "constant.other.unit"
    assert scope("in 1.0..", "50.0") == "constant.numeric"
    assert scope("axes_authority -> ", "USED") == "variable.other.enummember"
    assert scope("(SDK_authority == ", "AVAILABLE") == "variable.other.enummember"


def _words(dialect: str) -> set[str]:
    reader = dialect_of(f"s.{dialect}")
    kinds = {kind for row in reader.tables.actions for kind in row if kind.isupper()}
    return {kind.lower() for kind in kinds if reader.vocabulary.is_word(kind)}


@pytest.mark.parametrize("dialect", DIALECTS)
def test_all_words_of_the_language_are_coloured_and_no_others(dialect: str) -> None:
    """The editor's grammar has to have all words of the language's grammar."""
    grammar = json.loads((EXTENSION / "syntaxes" / f"{dialect}.tmLanguage.json").read_text())
    repository = grammar["repository"]
    patterns = [
        pattern
        for part in ("values", "operators", "declarations", "keywords")
        for pattern in repository[part]["patterns"]
    ]
    listed = [re.match(r"\\b\(([a-z_|]+)\)", pattern["match"]) for pattern in patterns]
    assert {word for match in listed if match for word in match[1].split("|")} == _words(dialect)
    for word in _words(dialect):
        assert coloured(f"{word} ", dialect)[0].startswith(WORD_SCOPES), word


@pytest.mark.parametrize("dialect", DIALECTS)
def test_the_extension_names_what_it_holds(dialect: str) -> None:
    manifest = json.loads((EXTENSION / "package.json").read_text())
    (language,) = [item for item in manifest["contributes"]["languages"] if item["extensions"] == [f".{dialect}"]]
    (grammar,) = [item for item in manifest["contributes"]["grammars"] if item["language"] == language["id"]]
    assert (EXTENSION / language["configuration"]).is_file()
    assert json.loads((EXTENSION / grammar["path"]).read_text())["scopeName"] == grammar["scopeName"]
    assert (EXTENSION / manifest["main"]).is_file()


def test_brackets_and_comments_are_those_of_the_language() -> None:
    configuration = json.loads((EXTENSION / "language-configuration.json").read_text())
    line, (opening, closing) = configuration["comments"]["lineComment"], configuration["comments"]["blockComment"]
    text = f"{line} one\n{opening} two {closing}"
    assert [lexeme.kind for lexeme in Document(text, "s.skillset").lexemes] == [COMMENT, COMMENT]
    assert configuration["brackets"] == [["{", "}"], ["[", "]"], ["(", ")"]]
