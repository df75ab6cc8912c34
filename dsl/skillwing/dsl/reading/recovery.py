"""Driving the LALR parser across mistakes, so that one run finds every syntax problem of a file.

A mistake is first repaired in place (a closing bracket, a sign or a word is supposed, replaced or passed over), as in
Burke and Fisher, "A Practical Method for LR and LL Syntactic Error Diagnosis and Recovery" (TOPLAS 1987): a repair
counts if the parser can read on for some words behind it. Where no repair helps, the innermost block gives up the
element and the parser goes on behind it, as with yacc's `error` token.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any, Protocol

from lark import Token, UnexpectedToken
from lark.parsers.lalr_analysis import Shift

from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.reading.terminals import (
    BROKEN,
    CLOSERS,
    END,
    NAMED_BLOCKS,
    NO_WORDS,
    SIGNS,
    TOP_LEVEL,
    UNREADABLE,
    block_title,
    capitalised,
    either,
    kind_text,
    may_be_name,
    token_text,
)
from skillwing.dsl.spans import Span
from skillwing.dsl.suggest import closest

_LOOKAHEAD = 3  # words behind a repair that the parser has to be able to read
_MOST_PROBLEMS = 100


class ParserState(Protocol):
    """What is used of Lark's LALR parser state, which has no types of its own."""

    state_stack: list[int]
    value_stack: list[object]
    parse_conf: Any

    def feed_token(self, token: Token, is_end: bool = False) -> object: ...


@dataclass(frozen=True, slots=True)
class _Block:
    """A bracket that is open. title: `skill takeoff` or `input` for the reader."""

    title: str
    line: int
    sign: str


class Recovery:
    """One parse of one file. After `run`, `diagnostics` holds its problems."""

    def __init__(self, state: ParserState, tokens: Sequence[Token], file: str) -> None:
        self.diagnostics: list[Diagnostic] = []
        self.elements_lost = False
        self._state = state
        self._table: Mapping[int, Mapping[str, tuple[object, Any]]] = state.parse_conf.parse_table.states
        self._end_state: int = state.parse_conf.end_state
        self._file = file
        self._tokens = [*tokens, Token(END, "")]
        self._at = 0
        self._last_line = tokens[-1].end_line or 1 if tokens else 1
        self._last_column = tokens[-1].end_column or 1 if tokens else 1

    def run(self) -> object:
        """Parse to the end; return the root node, or None if the file could not be read as a skillset at all."""
        if self._type_at(0) == END:
            self._report("SW006", self._tokens[0], "The file is empty.", "Write `skillset NAME { ... }`.")
            return None
        while True:
            token = self._tokens[self._at]
            try:
                root = self._state.feed_token(token, token.type == END)
            except UnexpectedToken:
                if len(self.diagnostics) >= _MOST_PROBLEMS or not self._mend(token):
                    return None
                continue
            if token.type == END:
                return root
            self._at += 1

    # --- the mistakes, the likeliest first

    def _mend(self, token: Token) -> bool:
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

    def _word_as_name(self, token: Token) -> bool:
        """A word of the language may also be a name, where only a name fits."""
        if token.type == "NAME" or not may_be_name(token.type, self._type_at(1)) or not self._reads(["NAME"]):
            return False
        self._tokens[self._at] = Token.new_borrow_pos("NAME", str(token), token)
        return True

    def _unreadable(self, token: Token) -> bool:
        match token.type:
            case "UNCLOSED_COMMENT":
                self._report("SW004", token, "This comment is never closed.", "Close it with `*/`.", first_line=True)
            case "UNCLOSED_STRING":
                self._report("SW004", token, "This string is never closed.", 'Close it with `"` on the same line.')
            case "OVERSIZED_NUMBER":
                self._report("SW004", token, "This number is too large.", "Write one that a computer can count with.")
                self._tokens[self._at] = Token.new_borrow_pos("NUMBER", "1", token)
                return True
            case "UNCLOSED_BRACKET":
                self._report("SW004", token, "This bracket is never closed.", f"Write `{token.strip()}]`.")
            case "UNKNOWN_CHARACTER":
                message = f"The language has no character `{token}`."
                advice = "Elements need no separator between them." if token in {",", ";"} else "Remove it."
                self._report("SW004", token, message, advice)
                # One report for a run of them.
                while self._type_at(1) == "UNKNOWN_CHARACTER":
                    del self._tokens[self._at]
            case _:
                return False
        del self._tokens[self._at]
        return True

    def _no_header(self, token: Token) -> bool:
        if self._at > 0 or token.type not in TOP_LEVEL:
            return False
        self._report(
            "SW006",
            token,
            f"`{token}` stands outside a skillset.",
            "Put everything into one `skillset NAME { ... }`.",
        )
        header = [("SKILLSET", "skillset"), ("NAME", "unnamed"), ("OPEN", "{")]
        self._tokens[:0] = [Token.new_borrow_pos(kind, text, token) for kind, text in header]
        self._tokens.insert(-1, Token.new_borrow_pos("CLOSE", "}", self._tokens[-2]))
        return True

    def _second_skillset(self, token: Token) -> bool:
        if token.type != "SKILLSET" or self._acceptable() != [END]:
            return False
        self._report("SW006", token, "A file holds one skillset.", "Move this one into a file of its own.")
        del self._tokens[self._at : -1]
        return True

    def _misspelt(self, token: Token) -> bool:
        word = self._meant_word(token, self._state.state_stack, 1)
        if word is None:
            return False
        self._replace_misspelt(token, word)
        return True

    def _misspelt_before(self) -> bool:
        """The word before was read as a name, and was meant as a word of the language: `intial A`."""
        values, stack = self._state.value_stack, self._state.state_stack
        token = values[-1] if values else None
        if not isinstance(token, Token) or token is not self._tokens[self._at - 1]:
            return False
        word = self._meant_word(token, stack[:-1], 0)
        if word is None:
            return False
        stack.pop()
        values.pop()
        self._at -= 1
        self._replace_misspelt(token, word)
        return True

    def _meant_word(self, token: Token, stack: Sequence[int], behind: int) -> str | None:
        """The word of the language that a name resembles and that the parser could read there, with what follows."""
        if token.type != "NAME":
            return None
        words = [kind.lower() for kind in self._acceptable(stack) if kind not in NO_WORDS]
        word = closest(token, words)
        return word if word and self._reads([word.upper(), *self._types_from(behind)], stack) else None

    def _replace_misspelt(self, token: Token, word: str) -> None:
        self._report("SW003", token, f"`{token}` is no word of the language.", f"Did you mean `{word}`?")
        self._tokens[self._at] = Token.new_borrow_pos(word.upper(), word, token)

    def _nameless(self, token: Token) -> bool:
        keyword = self._tokens[self._at - 1] if self._at else token
        if keyword.type not in NAMED_BLOCKS or not self._reads(["NAME", *self._types_from(0)]):
            return False
        self._report("SW005", token, f"This {keyword} has no name.", f"Write `{keyword} NAME {{ ... }}`.")
        self._tokens.insert(self._at, Token.new_borrow_pos("NAME", "", token))
        return True

    def _unclosed(self, token: Token) -> bool:
        """A closing bracket is missing: the words read on once the innermost open blocks are closed."""
        if token.type != END and token.type in SIGNS and token.type != "CLOSE":
            return False
        blocks = self._open_blocks()
        closers: list[str] = []
        for block in reversed(blocks):
            closers.append(block.sign)
            if not self._reads(closers):
                return False
            if self._reads([*closers, *self._types_from(0)]):
                break
        else:
            return False
        unclosed = blocks[len(blocks) - len(closers) :]
        titles = ", ".join(f"{block.title} (line {block.line})" for block in unclosed)
        verb = "is" if len(unclosed) == 1 else "are"
        texts = [SIGNS[sign] for sign in closers]
        place = "at the end of the file" if token.type == END else f"before `{token}`"
        self._report(
            "SW001",
            self._gap(),
            f"Missing `{' '.join(texts)}` {place}: {titles} {verb} never closed.",
            f"Add `{' '.join(texts)}` here.",
        )
        self._tokens[self._at : self._at] = [
            Token.new_borrow_pos(sign, text, self._anchor()) for sign, text in zip(closers, texts, strict=True)
        ]
        return True

    def _missing_sign(self, token: Token) -> bool:
        for sign, text in SIGNS.items():
            if sign != "CLOSE" and self._reads([sign, *self._types_from(0)]):
                message = f"Missing `{text}` {self._before(token)}."
                self._report("SW005", self._gap(), message, f"Write `{text}` here.")
                self._tokens.insert(self._at, Token.new_borrow_pos(sign, text, self._anchor()))
                return True
        return False

    def _wrong_sign(self, token: Token) -> bool:
        if token.type not in SIGNS:
            return False
        for sign, text in SIGNS.items():
            if self._reads([sign, *self._types_from(1)]):
                self._report("SW005", token, f"`{token}` stands where `{text}` belongs.", f"Write `{text}`.")
                self._tokens[self._at] = Token.new_borrow_pos(sign, text, token)
                return True
        return False

    def _superfluous(self, token: Token) -> bool:
        if token.type == END or not self._reads(self._types_from(1)):
            return False
        self._report_unexpected(token)
        del self._tokens[self._at]
        return True

    def _give_up_element(self, token: Token) -> bool:
        """Drop the element under way, and the words up to where its block can go on."""
        stack, values = self._state.state_stack, self._state.value_stack
        depth = next((depth for depth in range(len(stack), 0, -1) if self._reads([BROKEN], stack[:depth])), None)
        self._report_unexpected(token)
        if depth is None:
            return False
        del stack[depth:], values[depth - 1 :]
        self._state.feed_token(Token(BROKEN, ""))
        self.elements_lost |= len(self._open_blocks()) <= 1 or self._inside_declarations()
        opened = 0
        while self._type_at(0) != END:
            if opened == 0 and self._reads(self._types_from(0, 2)):
                return True
            opened += {"OPEN": 1, "CLOSE": -1 if opened else 0}.get(self._type_at(0), 0)
            self._at += 1
        return True

    # --- looking ahead

    def _type_at(self, offset: int) -> str:
        index = self._at + offset
        return self._tokens[index].type if index < len(self._tokens) else END

    def _types_from(self, offset: int, count: int = _LOOKAHEAD) -> list[str]:
        """The words ahead, without the unreadable ones, which are reported when their turn comes."""
        words = islice(self._tokens, self._at + offset, self._at + offset + count + _LOOKAHEAD)
        return [token.type for token in words if token.type not in UNREADABLE][:count]

    def _reads(self, kinds: Sequence[str], stack: Sequence[int] | None = None) -> bool:
        """Tell whether the parser could shift these words from here, by walking its tables without building."""
        states = list(self._state.state_stack if stack is None else stack)
        for kind, follower in zip(kinds, [*kinds[1:], ""], strict=True):
            as_name = kind not in self._table[states[-1]] and may_be_name(kind, follower)
            if not self._advance(states, "NAME" if as_name else kind):
                return False
        return True

    def _advance(self, states: list[int], kind: str) -> bool:
        """Shift one word on a stack of states, reducing before it as the table says."""
        while kind in self._table[states[-1]]:
            action, argument = self._table[states[-1]][kind]
            if action is Shift:
                states.append(argument)
                return True
            del states[len(states) - len(argument.expansion) :]
            states.append(self._table[states[-1]][argument.origin.name][1])
            if kind == END and states[-1] == self._end_state:
                return True
        return False

    def _acceptable(self, stack: Sequence[int] | None = None) -> list[str]:
        states = self._state.state_stack if stack is None else stack
        actions = self._table[states[-1]]
        return sorted(
            kind
            for kind in actions
            if kind == END or (kind.isupper() and kind != BROKEN and self._reads([kind], states))
        )

    def _open_blocks(self) -> list[_Block]:
        """The brackets that the parser has open, outermost first: they wait on its stack for their rule's end."""
        values = self._state.value_stack
        blocks: list[_Block] = []
        for index, value in enumerate(values):
            if isinstance(value, Token) and value.type in CLOSERS.values():
                blocks.pop()  # closed, and only waiting for the word behind it
            elif isinstance(value, Token) and value.type in CLOSERS:
                blocks.append(_Block(block_title(values[:index]), value.line or 1, CLOSERS[value.type]))
        return blocks

    def _inside_declarations(self) -> bool:
        """Whether names that other elements may use are declared in the block under way."""
        return not any(block.title.startswith("skill `") for block in self._open_blocks())

    # --- reporting

    def _anchor(self) -> Token:
        """A token whose position a supposed token borrows."""
        return self._tokens[self._at - 1] if self._at else self._tokens[0]

    def _gap(self) -> Span:
        """The place right behind the last word that was read."""
        if not self._at:
            return Span(self._file, 1, 1, 1, 1)
        last = self._tokens[self._at - 1]
        line, column = last.end_line or 1, last.end_column or 1
        return Span(self._file, line, column, line, column + 1)

    def _before(self, token: Token) -> str:
        return "at the end of the file" if token.type == END else f"before `{token}`"

    def _span(self, token: Token) -> Span:
        if token.type == END:
            return Span(self._file, self._last_line, self._last_column, self._last_line, self._last_column + 1)
        line, column = token.line or 1, token.column or 1
        return Span(self._file, line, column, token.end_line or line, token.end_column or column + 1)

    def _report(self, code: str, place: Token | Span, message: str, advice: str, first_line: bool = False) -> None:
        span = self._span(place) if isinstance(place, Token) else place
        if first_line:
            span = Span(span.file, span.line, span.column, span.line, span.column + 2)
        self.diagnostics.append(Diagnostic(code, span, message, advice))

    def _report_unexpected(self, token: Token) -> None:
        blocks = self._open_blocks()
        acceptable = self._acceptable()
        if acceptable == [END]:
            message = f"{capitalised(token_text(token))} stands behind the end of the skillset."
            advice = "A `}` before it is one too many, or it belongs into a file of its own."
            self._report("SW006", token, message, advice)
            return
        where = f" in {blocks[-1].title}" if blocks else ""
        options = [kind_text(kind) for kind in acceptable]
        message = f"{capitalised(token_text(token))} has no place here{where}."
        self._report("SW002", token, message, f"Here may stand {either(options)}.")
