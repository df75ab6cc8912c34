"""Sets of situations against the sets that they stand for, enumerated."""

from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.dsl.checking.checker import check
from skillwing.dsl.checking.reachability import relations, situations
from skillwing.dsl.checking.reachability.relations import Relation
from skillwing.dsl.checking.reachability.situations import Changes, Situations

NAMES = ("a", "b", "c")
STATES = ("0", "1", "2")
Rows = set[tuple[str, ...]]

some_states = st.frozensets(st.sampled_from(STATES))


@st.composite
def relations_on(draw: st.DrawFn) -> Relation:
    names = tuple(draw(st.lists(st.sampled_from(NAMES), max_size=3, unique=True)))
    rows = st.tuples(*(st.sampled_from(STATES) for _ in names))
    return Relation(names, draw(st.frozensets(rows)))


@st.composite
def effects(draw: st.DrawFn) -> Changes:
    names = draw(st.lists(st.sampled_from(NAMES), max_size=3, unique=True))
    targets = [draw(st.sampled_from(STATES)) for _ in names]
    return tuple((name, target, draw(some_states) | {target}) for name, target in zip(names, targets, strict=True))


@st.composite
def sets(draw: st.DrawFn) -> Situations:
    found = Situations.independent({name: draw(some_states) for name in NAMES})
    for relation in draw(st.lists(relations_on(), max_size=2)):
        found = found.where(relation)
    return found


def enumerated(found: Situations) -> Rows:
    one = {row: Relation(NAMES, frozenset([row])) for row in product(STATES, repeat=3)}
    return {row for row, relation in one.items() if not found.where(relation).empty}


def in_relation(row: tuple[str, ...], relation: Relation) -> bool:
    return tuple(row[NAMES.index(name)] for name in relation.names) in relation.rows


def able(row: tuple[str, ...], changes: Changes) -> bool:
    return all(row[NAMES.index(name)] in sources for name, _, sources in changes)


@given(sets(), relations_on(), st.booleans())
def test_narrowing_is_exact(found: Situations, relation: Relation, wanted: bool) -> None:
    expected = {row for row in enumerated(found) if in_relation(row, relation) is wanted}
    narrowed = found.where(relation, wanted)
    assert enumerated(narrowed) == expected
    assert narrowed.empty == (not expected)
    assert [narrowed.states(name) for name in NAMES] == [{row[column] for row in expected} for column in range(3)]


@given(sets(), effects())
def test_effects_lead_where_they_lead(found: Situations, changes: Changes) -> None:
    before = enumerated(found)
    targets = {name: target for name, target, _ in changes}
    after = {
        tuple(targets.get(name, state) for name, state in zip(NAMES, row, strict=True))
        for row in before
        if able(row, changes)
    }
    assert enumerated(found.able(changes)) == {row for row in before if able(row, changes)}
    assert enumerated(found.after(changes)) == after
    # The union of several sets may hold more than they do, never less.
    assert enumerated(found.unable(changes)) >= {row for row in before if not able(row, changes)}
    assert found.unable(changes).empty == all(able(row, changes) for row in before)


@given(sets(), sets())
def test_a_union_leaves_nothing_out(left: Situations, right: Situations) -> None:
    united = enumerated(left.union(right))
    assert united >= enumerated(left) | enumerated(right)
    listed = [Situations.enumerated(NAMES, enumerated(each)) for each in (left, right)]
    assert enumerated(listed[0].union(listed[1])) == enumerated(left) | enumerated(right)


# --- limits

TIED = """
skillset s {
    resource a { initial X  extern X -> Y  extern Y -> X }
    resource b { initial X  extern X -> Y  extern Y -> X }
    resource c { initial X  extern X -> Y  extern Y -> X }
    skill k {
        precondition {
            p: resource=(a == X or b == X)
            q: resource=(b == X or c == X)
        }
        result { DONE }
    }
}
"""


def codes() -> list[str]:
    return [diagnostic.code for diagnostic in check(TIED, "f").diagnostics]


def test_a_file_is_not_enumerated_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    assert codes() == []
    monkeypatch.setattr(relations, "_MOST_IN_ALL", 4)
    (diagnostic,) = check(TIED, "f").diagnostics
    assert (diagnostic.code, diagnostic.span.line) == ("SW088", 9)
    assert diagnostic.help == "The predicates of this file have too many in all: let them name fewer resources each."


def test_predicates_that_tie_too_much_together_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(situations, "_MOST_ROWS", 2)
    assert codes() == ["SW088"]
