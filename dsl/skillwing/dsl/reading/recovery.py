"""Driving the LALR parser across mistakes, so that one run finds every syntax problem of a file.

A mistake is first repaired in place (a closing bracket, a sign or a word is supposed, replaced or passed over), as in
Burke and Fisher, "A Practical Method for LR and LL Syntactic Error Diagnosis and Recovery" (TOPLAS 1987): a repair
counts if the parser can read on for some words behind it. Where no repair helps, the innermost block gives up the
element and the parser goes on behind it, as with yacc's `error` token.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import islice

from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.reading.dialect import Dialect
from skillwing.dsl.reading.lexemes import Lexeme, Source
from skillwing.dsl.reading.machine import Machine
from skillwing.dsl.reading.tables import END
from skillwing.dsl.reading.terminals import BROKEN, CLOSERS, UNREADABLE, capitalised, either
from skillwing.dsl.spans import Span
from skillwing.dsl.suggest import closest

_LOOKAHEAD = 3  # words behind a repair that the parser has to be able to read
_MOST_PROBLEMS = 100


@dataclass(frozen=True, slots=True)
class _Block:
    """A bracket that is open. title: `skill takeoff` or `input` for the reader."""

    title: str
    line: int
    sign: str


class Recovery:
    """One parse of one file. After `run`, `diagnostics` holds its problems."""

    def __init__(self, dialect: Dialect, lexemes: Iterable[Lexeme], source: Source) -> None:
        self.diagnostics: list[Diagnostic] = []
        self.elements_lost = False
        self._words = dialect.vocabulary
        self._machine = Machine(dialect.tables)
        self._source = source
        self._lexemes = list(lexemes)
        end = self._lexemes[-1].end if self._lexemes else 0
        self._lexemes.append(Lexeme(END, "", end, end, source))
        self._at = 0

    def run(self) -> object:
        """Parse to the end; return the root node, or None if the file could not be read as a skillset at all."""
        if len(self._lexemes) == 1:
            self._report("SW006", self._lexemes[0], "The file is empty.", "Write `skillset NAME { ... }`.")
            return None
        while (at := self._machine.run(self._lexemes, self._at)) < len(self._lexemes):
            self._at = at
            if len(self.diagnostics) >= _MOST_PROBLEMS or not self._mend(self._lexemes[at]):
                return None
        return self._machine.values[0]

    # --- the mistakes, the likeliest first

    def _mend(self, token: Lexeme) -> bool:
        """Change the words ahead, or the parser's state, so that the parse can go on; False if it cannot."""
        return (
            self._word_as_name(token)
            or self._unreadable(token)
            or self._no_header(token)
            or self._second_skillset(token)
            or self._misspelt(token)
            or self._misspelt_before()
            or self._nameless(token)
            or self._unclosed(token)
            or self._missing_sign(token)
            or self._wrong_sign(token)
            or self._superfluous(token)
            or self._give_up_element(token)
        )

    def _word_as_name(self, token: Lexeme) -> bool:
        """A word of the language may also be a name, where only a name fits."""
        if (
            token.kind == "NAME"
            or not self._words.may_be_name(token.kind, self._kind_at(1))
            or not self._reads(["NAME"])
        ):
            return False
        self._lexemes[self._at] = token.supposed("NAME", token.text)
        return True

    def _unreadable(self, token: Lexeme) -> bool:
        match token.kind:
            case "UNCLOSED_COMMENT":
                self._report("SW004", token, "This comment is never closed.", "Close it with `*/`.", first_line=True)
            case "UNCLOSED_STRING":
                self._report("SW004", token, "This string is never closed.", 'Close it with `"` on the same line.')
            case "OVERSIZED_NUMBER":
                self._report("SW004", token, "This number is too large.", "Write one that a computer can count with.")
                self._lexemes[self._at] = token.supposed("NUMBER", "1")
                return True
            case "UNCLOSED_BRACKET":
                self._report("SW004", token, "This bracket is never closed.", f"Write `{token.text.strip()}]`.")
            case "UNKNOWN_CHARACTER":
                message = f"The language has no character `{token.text}`."
                advice = "Elements need no separator between them." if token.text in {",", ";"} else "Remove it."
                self._report("SW004", token, message, advice)
                # One report for a run of them.
                while self._kind_at(1) == "UNKNOWN_CHARACTER":
                    del self._lexemes[self._at]
            case _:
                return False
        del self._lexemes[self._at]
        return True

    def _no_header(self, token: Lexeme) -> bool:
        if self._at > 0 or token.kind not in self._words.elements:
            return False
        self._report(
            "SW006",
            token,
            f"`{token.text}` stands outside a skillset.",
            "Put everything into one `skillset NAME { ... }`.",
        )
        header = [("SKILLSET", "skillset"), ("NAME", "unnamed"), ("OPEN", "{")]
        self._lexemes[:0] = [token.supposed(kind, text) for kind, text in header]
        self._lexemes.insert(-1, self._lexemes[-2].supposed("CLOSE", "}"))
        return True

    def _second_skillset(self, token: Lexeme) -> bool:
        if token.kind != "SKILLSET" or self._acceptable() != [END]:
            return False
        self._report("SW006", token, "A file holds one skillset.", "Move this one into a file of its own.")
        del self._lexemes[self._at : -1]
        return True

    def _misspelt(self, token: Lexeme) -> bool:
        word = self._meant_word(token, self._machine.states, 1)
        if word is None:
            return False
        self._replace_misspelt(token, word)
        return True

    def _misspelt_before(self) -> bool:
        """The word before was read as a name, and was meant as a word of the language: `intial A`."""
        values, stack = self._machine.values, self._machine.states
        token = values[-1] if values else None
        if not isinstance(token, Lexeme) or token is not self._lexemes[self._at - 1]:
            return False
        word = self._meant_word(token, stack[:-1], 0)
        if word is None:
            return False
        stack.pop()
        values.pop()
        self._at -= 1
        self._replace_misspelt(token, word)
        return True

    def _meant_word(self, token: Lexeme, stack: Sequence[int], behind: int) -> str | None:
        """The word of the language that a name resembles and that the parser could read there, with what follows."""
        if token.kind != "NAME":
            return None
        words = [kind.lower() for kind in self._acceptable(stack) if self._words.is_word(kind)]
        word = closest(token.text, words)
        return word if word and self._reads([word.upper(), *self._kinds_from(behind)], stack) else None

    def _replace_misspelt(self, token: Lexeme, word: str) -> None:
        self._report("SW003", token, f"`{token.text}` is no word of the language.", f"Did you mean `{word}`?")
        self._lexemes[self._at] = token.supposed(word.upper(), word)

    def _nameless(self, token: Lexeme) -> bool:
        keyword = self._lexemes[self._at - 1] if self._at else token
        if keyword.kind not in self._words.named_blocks or not self._reads(["NAME", *self._kinds_from(0)]):
            return False
        self._report("SW005", token, f"This {keyword.text} has no name.", f"Write `{keyword.text} NAME {{ ... }}`.")
        self._lexemes.insert(self._at, token.supposed("NAME", ""))
        return True

    def _unclosed(self, token: Lexeme) -> bool:
        """A closing bracket is missing: the words read on once the innermost open blocks are closed."""
        if token.kind != END and token.kind in self._words.signs and token.kind != "CLOSE":
            return False
        blocks = self._open_blocks()
        closers: list[str] = []
        for block in reversed(blocks):
            closers.append(block.sign)
            if not self._reads(closers):
                return False
            if self._reads([*closers, *self._kinds_from(0)]):
                break
        else:
            return False
        unclosed = blocks[len(blocks) - len(closers) :]
        titles = ", ".join(f"{block.title} (line {block.line})" for block in unclosed)
        verb = "is" if len(unclosed) == 1 else "are"
        texts = [self._words.signs[sign] for sign in closers]
        place = "at the end of the file" if token.kind == END else f"before `{token.text}`"
        self._report(
            "SW001",
            self._gap(),
            f"Missing `{' '.join(texts)}` {place}: {titles} {verb} never closed.",
            f"Add `{' '.join(texts)}` here.",
        )
        self._lexemes[self._at : self._at] = [
            self._anchor().supposed(sign, text) for sign, text in zip(closers, texts, strict=True)
        ]
        return True

    def _missing_sign(self, token: Lexeme) -> bool:
        for sign, text in self._words.signs.items():
            if sign != "CLOSE" and self._reads([sign, *self._kinds_from(0)]):
                message = f"Missing `{text}` {self._before(token)}."
                self._report("SW005", self._gap(), message, f"Write `{text}` here.")
                self._lexemes.insert(self._at, self._anchor().supposed(sign, text))
                return True
        return False

    def _wrong_sign(self, token: Lexeme) -> bool:
        if token.kind not in self._words.signs:
            return False
        for sign, text in self._words.signs.items():
            if self._reads([sign, *self._kinds_from(1)]):
                self._report("SW005", token, f"`{token.text}` stands where `{text}` belongs.", f"Write `{text}`.")
                self._lexemes[self._at] = token.supposed(sign, text)
                return True
        return False

    def _superfluous(self, token: Lexeme) -> bool:
        if token.kind == END or not self._reads(self._kinds_from(1)):
            return False
        self._report_unexpected(token)
        del self._lexemes[self._at]
        return True

    def _give_up_element(self, token: Lexeme) -> bool:
        """Drop the element under way, and the words up to where its block can go on."""
        stack, values = self._machine.states, self._machine.values
        depth = next((depth for depth in range(len(stack), 0, -1) if self._reads([BROKEN], stack[:depth])), None)
        self._report_unexpected(token)
        if depth is None:
            return False
        del stack[depth:], values[depth - 1 :]
        self._machine.run([token.supposed(BROKEN, "")])
        self.elements_lost |= len(self._open_blocks()) <= 1 or self._inside_declarations()
        opened = 0
        while self._kind_at(0) != END:
            if opened == 0 and self._reads(self._kinds_from(0, 2)):
                return True
            opened += {"OPEN": 1, "CLOSE": -1 if opened else 0}.get(self._kind_at(0), 0)
            self._at += 1
        return True

    # --- looking ahead

    def _kind_at(self, offset: int) -> str:
        index = self._at + offset
        return self._lexemes[index].kind if index < len(self._lexemes) else END

    def _kinds_from(self, offset: int, count: int = _LOOKAHEAD) -> list[str]:
        """The words ahead, without the unreadable ones, which are reported when their turn comes."""
        words = islice(self._lexemes, self._at + offset, self._at + offset + count + _LOOKAHEAD)
        return [token.kind for token in words if token.kind not in UNREADABLE][:count]

    def _reads(self, kinds: Sequence[str], stack: Sequence[int] | None = None) -> bool:
        """Tell whether the parser could shift these words from here, by walking its tables without building."""
        states = list(self._machine.states if stack is None else stack)
        for kind, follower in zip(kinds, [*kinds[1:], ""], strict=True):
            as_name = kind not in self._machine.actions[states[-1]] and self._words.may_be_name(kind, follower)
            if not self._machine.advance(states, "NAME" if as_name else kind):
                return False
        return True

    def _acceptable(self, stack: Sequence[int] | None = None) -> list[str]:
        states = self._machine.states if stack is None else stack
        actions = self._machine.actions[states[-1]]
        return sorted(
            kind
            for kind in actions
            if kind == END or (kind.isupper() and kind != BROKEN and self._reads([kind], states))
        )

    def _open_blocks(self) -> list[_Block]:
        """The brackets that the parser has open, outermost first: they wait on its stack for their rule's end."""
        values = self._machine.values
        blocks: list[_Block] = []
        for index, value in enumerate(values):
            if isinstance(value, Lexeme) and value.kind in CLOSERS.values():
                blocks.pop()  # closed, and only waiting for the word behind it
            elif isinstance(value, Lexeme) and value.kind in CLOSERS:
                blocks.append(_Block(self._words.block_title(values[:index]), value.span.line, CLOSERS[value.kind]))
        return blocks

    def _inside_declarations(self) -> bool:
        """Whether names that other elements may use are declared in the block under way."""
        return not any(block.title.startswith("skill `") for block in self._open_blocks())

    # --- reporting

    def _anchor(self) -> Lexeme:
        """A token whose position a supposed token borrows."""
        return self._lexemes[self._at - 1] if self._at else self._lexemes[0]

    def _gap(self) -> Span:
        """The place right behind the last word that was read."""
        return self._character(self._lexemes[self._at - 1].end if self._at else 0)

    def _character(self, offset: int) -> Span:
        line, column = self._source.place(offset)
        return Span(self._source.file, line, column, line, column + 1)

    def _before(self, token: Lexeme) -> str:
        return "at the end of the file" if token.kind == END else f"before `{token.text}`"

    def _span(self, token: Lexeme) -> Span:
        return token.span if token.end > token.start else self._character(token.end)

    def _report(self, code: str, place: Lexeme | Span, message: str, advice: str, first_line: bool = False) -> None:
        span = self._span(place) if isinstance(place, Lexeme) else place
        if first_line:
            span = Span(span.file, span.line, span.column, span.line, span.column + 2)
        self.diagnostics.append(Diagnostic(code, span, message, advice))

    def _report_unexpected(self, token: Lexeme) -> None:
        blocks = self._open_blocks()
        acceptable = self._acceptable()
        if acceptable == [END]:
            message = f"{capitalised(self._words.lexeme_text(token))} stands behind the end of the skillset."
            advice = "A `}` before it is one too many, or it belongs into a file of its own."
            self._report("SW006", token, message, advice)
            return
        where = f" in {blocks[-1].title}" if blocks else ""
        options = [self._words.kind_text(kind) for kind in acceptable]
        message = f"{capitalised(self._words.lexeme_text(token))} has no place here{where}."
        self._report("SW002", token, message, f"Here may stand {either(options)}.")
