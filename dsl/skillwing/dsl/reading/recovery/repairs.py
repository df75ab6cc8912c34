"""Repairs of syntax errors, so that one run finds every syntax problem of a file.

Lexical errors are fixed first. Then a missing `}` is inserted where the layout shows its place. Other errors are
repaired in place: a sign or a word is inserted, replaced or skipped. A repair counts if the parser can then read some
words ahead. See Burke and Fisher, "A Practical Method for LR and LL Syntactic Error Diagnosis and Recovery" (TOPLAS
1987). If no repair helps, the innermost block drops the element and the parser continues behind it, as with yacc's
`error` token.
"""

from __future__ import annotations

from itertools import groupby, islice
from operator import itemgetter

from skillwing.dsl.reading.lalr.grammar import END
from skillwing.dsl.reading.lalr.machine import TrialStack
from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.reading.recovery.broken_text import BEHIND_A_NAME, BrokenText
from skillwing.dsl.reading.recovery.cursor import OpenBracket
from skillwing.dsl.reading.recovery.layout import behind_what_belongs, unclosed_by_layout
from skillwing.dsl.reading.recovery.lexical_errors import fix_lexical_errors
from skillwing.dsl.reading.vocabulary import BROKEN, capitalised
from skillwing.dsl.suggest import closest

_MOST_PROBLEMS = 100
_MOST_UNCLOSED = 20  # brackets supposed at one place


class Recovery:
    """The parse of one file with repairs. The text then holds its diagnostics and the report of the recovery."""

    def __init__(self, text: BrokenText) -> None:
        self._text = text
        self._cursor = text.cursor
        self._words = text.words

    def run(self) -> object:
        """Parse to the end; return the root node, or None if the file could not be read as a skillset at all."""
        cursor = self._cursor
        if self._text.is_empty:
            self._text.report("SW006", cursor.next, "The file is empty.", "Write `skillset NAME { ... }`.")
            return None
        if not cursor.run():
            self._fix_lexical_errors()
            self._cursor.is_balanced = self._text.balance() == 0
            self._close_by_layout()
        while not cursor.run():
            if self._text.problems >= _MOST_PROBLEMS or not self._repair(cursor.next):
                return None
            cursor.mark()
        return cursor.machine.values[0]

    # --- before the words are judged

    def _fix_lexical_errors(self) -> None:
        """Fix all lexical errors. The words before the first syntax error have none."""
        cursor = self._cursor
        self._text.recovery.skip(lexeme for lexeme in cursor.lexemes if lexeme.kind == "UNCLOSED_COMMENT")
        is_unclosed = any(lexeme.kind == "UNCLOSED_COMMENT" for lexeme in cursor.lexemes)
        fixed, found = fix_lexical_errors(cursor.lexemes, self._words)
        cursor.lexemes[:] = fixed
        if is_unclosed and len(fixed) > 1:
            self._text.hidden_behind(fixed[-2])
        self._text.diagnostics += found[:_MOST_PROBLEMS]
        self._text.problems += len(found)

    def _close_by_layout(self) -> None:
        """Close the unclosed blocks where the layout shows their ends, and parse the file again."""
        cursor = self._cursor
        found = [
            (behind_what_belongs(cursor.lexemes, unclosed.closing, block.title, self._words), block)
            for unclosed in unclosed_by_layout(cursor.lexemes)
            for block in [cursor.block_opened_by(unclosed.opening)]
        ]
        found.sort(key=itemgetter(0))
        end = len(cursor.lexemes) - 1
        missing = self._text.balance()
        ends_in_a_block = missing > 1 and all(closing == end for closing, _ in found)
        if missing > 0 and (ends_in_a_block or cursor.lexemes[end - 1].kind != "CLOSE"):
            self._text.cut_behind(cursor.lexemes[end - 1])
        added = 0
        for closing, group in groupby(found, key=itemgetter(0)):
            added += self._text.close([block for _, block in group], closing + added)
        if found:
            cursor.restart()

    # --- the mistakes among the words, the likeliest first

    def _repair(self, lexeme: Lexeme) -> bool:
        """Change the words ahead, or the parser's state, so that the parse can continue; return False if it cannot."""
        return (
            self._word_as_name(lexeme)
            or self._no_header(lexeme)
            or self._behind_the_end(lexeme)
            or self._misspelt(lexeme)
            or self._misspelt_before()
            or self._misplaced(lexeme)
            or self._nameless(lexeme)
            or self._unclosed(lexeme)
            or self._missing_sign(lexeme)
            or self._wrong_sign(lexeme)
            or self._superfluous(lexeme)
            or self._give_up_element(lexeme)
        )

    def _word_as_name(self, lexeme: Lexeme) -> bool:
        """Read a keyword as a name, where only a name is allowed."""
        cursor = self._cursor
        fitting = cursor.machine.actions[cursor.machine.states[-1]]
        follower = cursor.kind_at(1)
        is_listed = cursor.is_balanced and follower != "OPEN" and self._words.may_be_listed(lexeme.kind, fitting)
        if not (is_listed or self._words.may_be_name(lexeme.kind, follower, fitting)):
            return False
        if not cursor.reads(["NAME", follower]):
            return False
        self._text.replace(lexeme.synthesised("NAME", lexeme.text))
        return True

    def _no_header(self, lexeme: Lexeme) -> bool:
        cursor = self._cursor
        if cursor.at > 0 or lexeme.kind not in self._words.elements:
            return False
        message = f"`{lexeme.text}` stands outside a skillset."
        self._text.report("SW006", lexeme, message, "Put everything into one `skillset NAME { ... }`.")
        header = [("SKILLSET", "skillset"), ("NAME", "unnamed"), ("OPEN", "{")]
        cursor.lexemes[:0] = [lexeme.synthesised(kind, text) for kind, text in header]
        cursor.lexemes.insert(-1, cursor.lexemes[-2].synthesised("CLOSE", "}"))
        return True

    def _behind_the_end(self, lexeme: Lexeme) -> bool:
        """Handle text behind the skillset: another skillset, or elements that are read as if they were in it."""
        cursor = self._cursor
        if cursor.acceptable() != [END] or cursor.last is None:
            return False
        if lexeme.kind == "SKILLSET":
            self._text.report("SW006", lexeme, "A file holds one skillset.", "Move this one into a file of its own.")
            self._text.pass_over(cursor.at, len(cursor.lexemes) - 1)
            return True
        message = f"{capitalised(self._words.lexeme_text(lexeme))} stands behind the end of the skillset."
        closed = cursor.last.span.line
        advice = (
            f"The `}}` at line {closed} ends the skillset: put everything before it, or remove one that is too many."
        )
        self._text.report("SW006", lexeme, message, advice)
        if lexeme.kind not in self._words.elements:
            self._text.pass_over(cursor.at, len(cursor.lexemes) - 1)
            return True
        if self._text.balance() == 0:
            cursor.lexemes.insert(-1, cursor.lexemes[-2].synthesised("CLOSE", "}"))
        cursor.machine.states.pop()
        cursor.machine.values.pop()
        return True

    def _misspelt(self, lexeme: Lexeme) -> bool:
        word = self._meant_word(lexeme, self._cursor.trial_stack(), 1)
        if word is None:
            return False
        self._replace_misspelt(lexeme, word)
        return True

    def _misspelt_before(self) -> bool:
        """Handle a keyword that was misspelt and read as a name, such as `intial A`."""
        cursor = self._cursor
        if cursor.last is None or cursor.last.kind != "NAME":
            return False
        earlier = cursor.before_last()
        word = None if earlier is None else self._meant_word(cursor.last, TrialStack(earlier.states), 0)
        if earlier is None or word is None:
            return False
        cursor.go_back(earlier)
        self._replace_misspelt(cursor.next, word)
        return True

    def _meant_word(self, lexeme: Lexeme, stack: TrialStack, behind: int) -> str | None:
        """The keyword that a name resembles, if the parser could read it there with the following words."""
        if lexeme.kind != "NAME":
            return None
        words = [kind.lower() for kind in self._cursor.acceptable(stack) if self._words.is_word(kind)]
        word = closest(lexeme.text, words)
        ahead = self._cursor.kinds_from(behind, count=2)  # A word that resembles another is evidence by itself.
        return word if word and self._cursor.reads([word.upper(), *ahead], stack) else None

    def _replace_misspelt(self, lexeme: Lexeme, word: str) -> None:
        self._text.report("SW003", lexeme, f"`{lexeme.text}` is no word of the language.", f"Did you mean `{word}`?")
        self._text.replace(lexeme.synthesised(word.upper(), word))

    def _nameless(self, lexeme: Lexeme) -> bool:
        """Handle a missing name: of a block, or before an effect, its change or a predicate."""
        cursor, last = self._cursor, self._cursor.last
        if last is not None and last.kind in self._words.named_blocks and cursor.reads(["NAME", *cursor.kinds_from(0)]):
            self._text.report("SW005", lexeme, f"This {last.text} has no name.", f"Write `{last.text} NAME {{ ... }}`.")
            cursor.lexemes.insert(cursor.at, lexeme.synthesised("NAME", ""))
            self._text.recovery.nameless.add(last.text)
            return True
        heading = ["NAME"] if lexeme.kind in BEHIND_A_NAME else ["NAME", "COLON"]
        if lexeme.kind != "NAME" and cursor.reads([*heading, *cursor.kinds_from(0)]):
            self._supply_name(lexeme)
            return True
        earlier = cursor.before_last() if last is not None and last.kind == "NAME" else None
        if earlier is None or last is None:
            return False
        for kind in (last.text.upper(), "NAME"):  # A word of the language may have been read as a name.
            if cursor.reads(["NAME", "COLON", kind, *cursor.kinds_from(0)], TrialStack(earlier.states)):
                cursor.go_back(earlier)
                self._text.replace(last.synthesised(kind, last.text))
                self._supply_name(cursor.next)
                return True
        return False

    def _supply_name(self, lexeme: Lexeme) -> None:
        cursor = self._cursor
        message = f"A name is missing before {self._words.lexeme_text(lexeme)}."
        synthesised = [lexeme.synthesised("NAME", ""), lexeme.synthesised("COLON", ":")]
        written = f"NAME: {lexeme.text} ..."
        if lexeme.kind in BEHIND_A_NAME:
            synthesised, written = synthesised[:1], "NAME: ..." if lexeme.kind == "COLON" else "NAME { ... }"
        self._text.report("SW005", lexeme, message, f"Write `{written}`.")
        self._text.recovery.nameless.update(block.keyword for block in cursor.blocks()[-1:])
        self._text.doubt_statement()
        self._text.recovery.guessed.append(lexeme.span)
        cursor.lexemes[cursor.at : cursor.at] = synthesised

    def _misplaced(self, lexeme: Lexeme) -> bool:
        """Handle a section or element in a wrong block, and read it behind the block that it fits behind."""
        cursor = self._cursor
        length = cursor.section_ahead() if self._words.is_word(lexeme.kind) else None
        if length is None or self._text.balance() != 0:
            return False
        blocks = cursor.blocks()
        stack = cursor.trial_stack()
        for depth, block in enumerate(islice(reversed(blocks), _MOST_UNCLOSED), 1):
            if not cursor.machine.reads(block.closer, stack):
                return False
            if cursor.reads([lexeme.kind, *cursor.kinds_from(1)], stack):
                message = f"`{lexeme.text}` does not belong into {blocks[-1].title}."
                self._text.report("SW002", lexeme, message, f"Write it behind the `}}` that closes {block.title}.")
                section = cursor.lexemes[cursor.at : cursor.at + length]
                del cursor.lexemes[cursor.at : cursor.at + length]
                behind = cursor.behind_blocks(cursor.at, depth)
                cursor.lexemes[behind:behind] = section
                return True
        return False

    def _unclosed(self, lexeme: Lexeme) -> bool:
        """Handle a missing closing bracket: the words are allowed once the innermost open blocks are closed."""
        cursor = self._cursor
        if lexeme.kind in self._words.signs and lexeme.kind != "CLOSE":
            return False
        stack = cursor.trial_stack()
        unclosed: list[OpenBracket] = []
        for block in islice(reversed(cursor.blocks()), _MOST_UNCLOSED):
            unclosed.append(block)
            if not cursor.machine.reads(block.closer, stack):
                return False
            if cursor.reads(cursor.kinds_from(0), stack):
                self._text.close(unclosed, cursor.at)
                return True
        return False

    def _missing_sign(self, lexeme: Lexeme) -> bool:
        cursor = self._cursor
        for sign, text in self._words.signs.items():
            if sign == "CLOSE" or (sign == "OPEN" and cursor.is_balanced):
                continue  # a missing `}` was looked for already, and no `{` is missing where none is too few
            if cursor.last is not None and cursor.reads([sign, *cursor.kinds_from(0)]):
                message = f"Missing `{text}` {self._text.before(lexeme)}."
                self._text.report("SW005", self._text.behind(cursor.at), message, f"Write `{text}` here.")
                self._text.recovery.guessed.append(cursor.last.span)
                cursor.lexemes.insert(cursor.at, cursor.last.synthesised(sign, text))
                return True
        return False

    def _wrong_sign(self, lexeme: Lexeme) -> bool:
        cursor = self._cursor
        if lexeme.kind not in self._words.signs or (lexeme.kind == "CLOSE" and cursor.is_balanced):
            return False
        for sign, text in self._words.signs.items():
            if cursor.reads([sign, *cursor.kinds_from(1)]):
                self._text.report(
                    "SW005", lexeme, f"`{lexeme.text}` stands where `{text}` belongs.", f"Write `{text}`."
                )
                self._text.recovery.guessed.append(lexeme.span)
                self._text.replace(lexeme.synthesised(sign, text))
                return True
        return False

    def _superfluous(self, lexeme: Lexeme) -> bool:
        cursor = self._cursor
        if lexeme.kind == END or not cursor.reads(cursor.kinds_from(1)):
            return False
        self._text.report_unexpected(lexeme)
        self._text.doubt_statement()
        self._text.doubt_name(lexeme)
        self._text.pass_over(cursor.at, cursor.at + 1)
        return True

    def _give_up_element(self, lexeme: Lexeme) -> bool:
        """Drop the present element, and skip words until its block can continue."""
        cursor = self._cursor
        states, values = cursor.machine.states, cursor.machine.values
        self._text.report_unexpected(lexeme)
        depths = range(len(states), 0, -1)
        depth = next((depth for depth in depths if cursor.reads([BROKEN], TrialStack(states, depth))), None)
        if depth is None:
            return False
        self._text.doubt_statement()
        self._text.doubt_name(lexeme)
        start = cursor.start_of(values[depth - 1 :])
        del states[depth:], values[depth - 1 :]
        cursor.machine.run([lexeme.synthesised(BROKEN, "")])
        opened = 0
        while cursor.kind_at(0) != END and not (opened == 0 and cursor.reads(cursor.kinds_from(0, 2))):
            opened += {"OPEN": 1, "CLOSE": -1 if opened else 0}.get(cursor.kind_at(0), 0)
            cursor.at += 1
        self._text.recovery.skip(cursor.lexemes[start : cursor.at])
        return True
