"""Every node of a tree has a place of its own, beside its parent and among its siblings."""

from __future__ import annotations

from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.services.protocol import TreeNode
from skillwing.services.telemetry.tree_layout import ROW, lay_out


@st.composite
def trees(draw: st.DrawFn) -> list[TreeNode]:
    size = draw(st.integers(1, 25))
    parents = [None, *(draw(st.integers(0, index - 1)) for index in range(1, size))]
    names = draw(st.lists(st.text("abc ", min_size=1, max_size=20), min_size=size, max_size=size))
    return [TreeNode(i, p, n, "Sequence", "INVALID") for i, (p, n) in enumerate(zip(parents, names, strict=True))]


@given(trees())
def test_pills_do_not_overlap_and_children_stand_to_the_right(nodes: list[TreeNode]) -> None:
    layout = lay_out(nodes)
    for a, b in combinations(layout.places, 2):
        apart = abs(a.x - b.x) >= a.half_width + b.half_width - 1e-6
        assert apart or abs(a.y - b.y) >= ROW - 1e-6
    for node, place in zip(nodes, layout.places, strict=True):
        if node.parent is not None:
            parent = layout.places[node.parent]
            assert parent.x + parent.half_width < place.x - place.half_width
    assert len(layout.branches) == len(nodes) - 1


@given(trees(), st.randoms())
def test_the_order_of_nodes_in_the_list_does_not_matter_for_columns(nodes: list[TreeNode], random) -> None:
    shuffled = random.sample(nodes, len(nodes))
    expected = {node.index: place.x for node, place in zip(nodes, lay_out(nodes).places, strict=True)}
    assert {n.index: p.x for n, p in zip(shuffled, lay_out(shuffled).places, strict=True)} == expected


def test_an_empty_tree_has_no_size() -> None:
    assert lay_out([]).places == ()


def test_what_is_not_a_tree_is_refused() -> None:
    def node(index: int, parent: int | None) -> TreeNode:
        return TreeNode(index, parent, "n", "Sequence", "INVALID")

    with pytest.raises(ValueError, match="ancestors"):
        lay_out([node(0, 1), node(1, 0)])
    with pytest.raises(ValueError, match="same index"):
        lay_out([node(0, None), node(0, None)])
