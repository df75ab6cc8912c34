"""The goal table keeps the promises of docs/semantics.md, and the page shows it as it is."""

from __future__ import annotations

from collections import Counter
from itertools import product
from pathlib import Path

import edges_run
import pytest
from goal_table import AFTER, BEFORE, SKILL, Edge, all_edges, example_events, example_states, page_text

from skillwing.services.core.goal_states import Ask, Asking, Finished, GivingBack, Holding
from skillwing.services.core.skill_actions import Hook
from skillwing.services.core.skill_events import Reply
from skillwing.services.protocol import Granted, State

PAGE = Path(__file__).parents[2] / "docs" / "semantics.md"
REACTIONS = [
    (state, event, reaction)
    for state, event, now in product(example_states(), example_events(), (BEFORE, AFTER))
    if (reaction := state.on(event, SKILL, now)) is not None
]


def test_the_page_shows_the_table_of_the_code() -> None:
    assert edges_run.TABLE.read(PAGE) == page_text(), "run `make generate`"


def test_cells_of_the_table_have_forty_words_at_most() -> None:
    cells = [cell for line in page_text().splitlines() if line.startswith("|") for cell in line.split("|")]
    assert max(len(cell.split()) for cell in cells) <= 40


def test_a_goal_never_moves_back() -> None:
    phases = list(State)
    for state, event, (after, _, _) in REACTIONS:
        assert phases.index(after.phase) >= phases.index(state.phase), (state, event)


def test_on_ended_runs_for_dispatched_goals_and_no_others() -> None:
    for state, event, (after, action, _) in REACTIONS:
        dispatched = isinstance(state, Holding) and not isinstance(state, GivingBack)
        assert (action is Hook.ENDED) == (dispatched and isinstance(after, Finished)), (state, event)


def test_a_question_is_put_once_when_its_state_begins() -> None:
    for state, event, (after, action, _) in REACTIONS:
        asks = after.question is not None and after.question is not state.question
        assert (action is Ask.RESOURCES) == asks, (state, event)


def test_a_grant_is_kept_until_the_goal_is_over() -> None:
    for state, event, (after, _, _) in REACTIONS:
        if isinstance(state, Holding) and not isinstance(after, Finished):
            assert after.token == state.token, (state, event)


def test_only_a_grant_dispatches_a_goal() -> None:
    for state, event, (_, action, _) in REACTIONS:
        if action is Hook.DISPATCH:
            assert type(state) is Asking, (state, event)
            assert isinstance(event, Reply) and isinstance(event.answer, Granted), (state, event)


def test_nothing_happens_to_a_finished_goal() -> None:
    assert not [edge for edge in all_edges() if edge.state == "Finished"]


def test_edges_that_nobody_takes_are_named() -> None:
    taken, never = all_edges()[:3], all_edges()[3:]
    text = edges_run.report({"tests": Counter(taken)})
    assert f"| tests | 3 of {len(all_edges())} | 3 |" in text
    assert [line.removeprefix("- ") for line in text.splitlines() if line.startswith("- ")] == [
        edge.text for edge in never
    ]


def test_an_edge_that_the_table_lacks_is_an_error() -> None:
    with pytest.raises(ValueError, match="Running: a storm -> Finished RI"):
        edges_run.report({"tests": Counter([Edge("Running", "a storm", "Finished RI", "")])})
