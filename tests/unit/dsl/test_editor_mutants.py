"""The editor's functions answer for any text."""

from __future__ import annotations

import random

import pytest
from editor_files import FILES, RL_FILES, document

from skillwing.dsl.editor.completion import completions
from skillwing.dsl.editor.description import hover
from skillwing.dsl.editor.document import Document
from skillwing.dsl.editor.fixes import fixes
from skillwing.dsl.editor.outline import folds, outline
from skillwing.dsl.editor.rename import RenameRefusedError, rename
from skillwing.dsl.editor.tokens import tokens

SMALL = [document(path) for path in (*FILES, *RL_FILES) if path.stat().st_size < 4000]


def mutated(found: Document, chance: random.Random) -> Document:
    """A few words of a text are dropped, doubled, swapped or cut in two; often its end is missing."""
    pieces = [found.text[: found.words[0].start]] if found.words else []
    for word, follower in zip(found.words, found.words[1:], strict=False):
        pieces.append(found.text[word.start : follower.start])
    for _ in range(chance.randint(1, 4)):
        at, other = chance.randrange(len(pieces)), chance.randrange(len(pieces))
        match chance.randrange(4):
            case 0:
                pieces[at] = ""
            case 1:
                pieces[at] += pieces[other]
            case 2:
                pieces[at], pieces[other] = pieces[other], pieces[at]
            case _:
                pieces[at] = pieces[at][: len(pieces[at]) // 2]
    text = "".join(pieces)
    return Document(text[: chance.randrange(len(text))] if chance.random() < 0.3 else text, found.file)


@pytest.mark.parametrize("seed", range(60))
def test_every_question_about_a_broken_file_has_an_answer(seed: int) -> None:
    chance = random.Random(seed)
    broken = mutated(chance.choice([found for found in SMALL if len(found.words) > 8]), chance)
    size = len(broken.text)
    for entry in outline(broken):
        assert 0 <= entry.start <= entry.name_start < entry.name_end <= entry.end <= size
    for fold in folds(broken):
        assert fold.first_line < fold.last_line <= broken.text.count("\n")
    for token in tokens(broken):
        assert broken.text[token.start : token.end].isidentifier()
    for fix in fixes(broken, 0, size):
        assert fix.edit.text.isidentifier()
    for offset in [chance.randint(0, size) for _ in range(6)]:
        shown = hover(broken, offset)
        assert shown is None or shown.start <= offset <= shown.end
        for completion in completions(broken, offset):
            assert completion.start <= offset <= completion.end
        try:
            edits = rename(broken, offset, "another")
        except RenameRefusedError as refusal:
            assert str(refusal)
        else:
            assert {broken.text[edit.start : edit.end] for edit in edits} != {"another"}
