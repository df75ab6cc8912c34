"""Every node of a tree has a row of its own, under its parent and among its siblings."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from skillwing.services.protocol import TreeNode
from skillwing.services.recording.tree_layout import ROW, ROWS, Outline, condensed, lay_out


@st.composite
def trees(draw: st.DrawFn) -> list[TreeNode]:
    size = draw(st.integers(1, 25))
    parents = [None, *(draw(st.integers(0, index - 1)) for index in range(1, size))]
    names = draw(st.lists(st.text("abc ", min_size=1, max_size=20), min_size=size, max_size=size))
    return [TreeNode(i, p, n, "Sequence", "INVALID") for i, (p, n) in enumerate(zip(parents, names, strict=True))]


@given(trees())
def test_each_node_has_a_row_below_its_parent_and_is_indented(nodes: list[TreeNode]) -> None:
    layout = lay_out(nodes)
    assert sorted(place.y / layout.row - 0.5 for place in layout.boxes) == pytest.approx(list(range(len(nodes))))
    for node, place in zip(nodes, layout.boxes, strict=True):
        if node.parent is not None:
            parent = layout.boxes[node.parent]
            assert (place.left, place.y) > (parent.left, parent.y)
    assert len(layout.branches) == len(nodes) - 1


@given(trees())
def test_rows_are_in_the_order_of_ticking(nodes: list[TreeNode]) -> None:
    """Rows between a node and its next sibling hold its descendants only."""
    layout = lay_out(nodes)
    rows = sorted(zip(nodes, layout.boxes, strict=True), key=lambda item: item[1].y)
    open_branch: list[int] = []
    for node, _ in rows:
        while open_branch and open_branch[-1] != node.parent:
            open_branch.pop()
        assert node.parent is None or open_branch
        open_branch.append(node.index)


def test_a_large_tree_fits_the_panel_too() -> None:
    nodes = [TreeNode(index, None if index == 0 else 0, "n", "Sequence", "RUNNING") for index in range(100)]
    assert max(place.y for place in lay_out(nodes).boxes) <= ROWS * ROW


def test_a_branch_opens_when_it_is_visited_and_stays_open() -> None:
    def snapshot(*statuses: str) -> list[TreeNode]:
        parents = (None, 0, 1, 0, 3)
        return [TreeNode(i, p, f"n{i}", "S", s) for i, (p, s) in enumerate(zip(parents, statuses, strict=True))]

    outline = Outline()
    run, failed, off = "RUNNING", "FAILURE", "INVALID"
    first = outline.shown(snapshot(run, run, run, off, off))
    assert [node.index for node in first] == [0, 1, 2, 3]
    second = outline.shown(snapshot(run, failed, failed, run, run))
    assert [node.index for node in second] == [0, 1, 2, 3, 4]
    third = outline.shown(snapshot(run, off, off, off, off))
    assert [node.index for node in third] == [0, 1, 2, 3, 4]


def test_of_a_branch_that_was_given_up_only_what_failed_is_shown() -> None:
    parents = (None, 0, 1, 2, 2, 1, 0)
    run, failed, done, off = "RUNNING", "FAILURE", "SUCCESS", "INVALID"

    def rows(*statuses: str) -> list[int]:
        nodes = [TreeNode(i, p, f"n{i}", "S", s) for i, (p, s) in enumerate(zip(parents, statuses, strict=True))]
        return [node.index for node in outline.shown(nodes)]

    outline = Outline()
    assert rows(run, run, run, done, run, off, off) == [0, 1, 2, 3, 4, 5, 6]
    assert rows(run, failed, failed, done, failed, off, run) == [0, 1, 2, 4, 6]
    assert rows(run, off, off, off, off, off, run) == [0, 1, 2, 4, 6]
    assert rows(run, run, run, run, off, off, off) == [0, 1, 2, 3, 4, 5, 6], "it is taken again"


@given(trees(), st.lists(st.lists(st.sampled_from(["RUNNING", "FAILURE", "INVALID"]), min_size=25, max_size=25)))
def test_what_is_shown_hangs_together(nodes: list[TreeNode], ticks: list[list[str]]) -> None:
    outline, visited = Outline(), set[int | None]([None])
    for statuses in ticks:
        snapshot: list[TreeNode] = []
        for node, status in zip(nodes, statuses, strict=False):
            # A node is visited only after its parent.
            snapshot.append(replace(node, status=status if node.parent in visited else "INVALID"))
            visited |= {node.index} if snapshot[-1].status != "INVALID" else set()
        rows = {node.index for node in outline.shown(snapshot)}
        assert all(nodes[index].parent is None or nodes[index].parent in rows for index in rows)


def test_an_empty_tree_has_no_size() -> None:
    assert lay_out([]).boxes == ()


def test_what_is_not_a_tree_is_refused() -> None:
    def node(index: int, parent: int | None) -> TreeNode:
        return TreeNode(index, parent, "n", "Sequence", "INVALID")

    with pytest.raises(ValueError, match="ancestors"):
        lay_out([node(0, 1), node(1, 0)])
    with pytest.raises(ValueError, match="same index"):
        lay_out([node(0, None), node(0, None)])


@given(trees(), st.data(), st.integers(1, 25))
def test_a_condensed_tree_keeps_order_and_ancestry_and_every_running_leaf(
    nodes: list[TreeNode], data: st.DataObject, rows: int
) -> None:
    status = st.sampled_from(("RUNNING", "SUCCESS", "FAILURE", "INVALID"))
    latest: dict[int, str] = {}
    for node in nodes:
        if (node.parent is None or node.parent in latest) and (found := data.draw(status)) != "INVALID":
            latest[node.index] = found
    kept = condensed(nodes, latest, rows)
    assert len(nodes) > rows or list(kept) == nodes
    parents = {node.index: node.parent for node in nodes}

    def ancestors(index: int) -> list[int]:
        above = parents[index]
        return [] if above is None else [above, *ancestors(above)]

    there = [node.index for node in kept]
    assert there == sorted(there)
    assert there[0] == 0
    for node in kept:
        left = [each for each in ancestors(node.index) if each in there]
        assert node.parent == (left[0] if left else None)
    inner = set(parents.values())
    for node in nodes:
        runs = all(latest.get(each) == "RUNNING" for each in (node.index, *ancestors(node.index)))
        assert not runs or node.index in inner or node.index in there
    lay_out(kept)


def test_the_tree_of_a_mission_on_two_robots_shows_what_each_does() -> None:
    depth = 30
    chain = [
        (1 + robot * depth + level, robot * depth + level if level else 0) for robot in (0, 1) for level in range(depth)
    ]
    nodes = [TreeNode(0, None, "both", "ParallelAll", "RUNNING")]
    nodes += [TreeNode(index, parent, f"n{index}", "Sequence", "RUNNING") for index, parent in chain]
    assert [node.name for node in Outline().shown(nodes)] == ["both", f"n{depth}", f"n{2 * depth}"]
