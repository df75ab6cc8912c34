"""Nodes of other packages, by entry points."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
from fake_interface import SKILLSET, FakeMission
from py_trees.behaviour import Behaviour
from py_trees.common import Status
from tree_files import mission_of, problems_of, with_tree

from skillwing.bt_missions.leaves.blackboard_entry import BlackboardEntry
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.xml import installed_nodes
from skillwing.bt_missions.xml.node_type import Category, NodeConfig, NodeType, Port
from skillwing.bt_missions.xml.writer import write_mission, write_models


class Doubled(Behaviour):
    """Sets an entry to twice a number."""

    def __init__(self, name: str, number: float, result: BlackboardEntry) -> None:
        super().__init__(name)
        self.number = number
        self.outputs = {"result": result}

    def update(self) -> Status:
        self.outputs["result"].write(2 * self.number)
        return Status.SUCCESS


def make_doubled(config: NodeConfig) -> Behaviour:
    return Doubled(config.name, config.number("number"), config.written("result"))


def described(node: Behaviour) -> Mapping[str, str] | None:
    if not isinstance(node, Doubled):
        return None
    return {"number": f"{node.number:g}", "result": f"{{{node.outputs['result'].name}}}"}


def raising(config: NodeConfig) -> Behaviour:
    raise ValueError("no time")


PORTS = (Port("number", "a number", "double"), Port("result", "twice that", "double", output=True))
DOUBLED = NodeType("Doubled", Category.ACTION, make_doubled, described, PORTS)
RAISING = NodeType("Raising", Category.ACTION, raising)
NOTHING = NodeType("Nothing", Category.ACTION, lambda config: None)  # type: ignore[arg-type, return-value]
GO = NodeType("go", Category.ACTION, raising)
TEXT = "no type"
Install = Callable[..., None]


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Install:
    """Install objects by `tag=module:object`; a name without a module is one of this file."""

    def put(**values: str) -> None:
        found = [
            EntryPoint(tag, value if ":" in value else f"{__name__}:{value}", installed_nodes.ENTRY_POINTS)
            for tag, value in values.items()
        ]

        def entry_points(group: str, name: str | None = None) -> list[EntryPoint]:
            return [entry for entry in found if name in (None, entry.name)]

        monkeypatch.setattr(installed_nodes, "entry_points", entry_points)

    return put


TREE = '<Sequence><Doubled name="twice" number="1.5" result="{fast}"/><go speed="{fast}"/></Sequence>'


def test_an_installed_node_is_a_tag_like_others(install: Install, mission: FakeMission) -> None:
    install(Doubled="DOUBLED")
    assert problems_of(with_tree(TREE)) == []
    loaded = mission_of(with_tree(TREE))
    trees = loaded.build(mission.context, loaded.Options())
    trees.root.tick_once()
    assert mission.goals[0].inputs == {"speed": 3.0}
    written = write_mission("main", trees, SKILLSET)
    assert '<Doubled name="twice" number="1.5" result="{fast}" />' in written
    assert '<Action ID="Doubled">' in written
    assert '<Action ID="Doubled">' in write_models(SKILLSET)


def test_its_attributes_and_entries_are_checked(install: Install) -> None:
    install(Doubled="DOUBLED")
    turned = '<Sequence><go name="first" speed="{fast}"/><Doubled name="twice" numbr="x" result="{fast}"/></Sequence>'
    assert sorted(problems_of(with_tree(turned))) == [
        "2: Leaf `first`: `speed` reads `{fast}` before `twice` sets it; put `twice` before this node.",
        "2: `Doubled` has no port `numbr`; did you mean `number`?",
        "2: `number` is `x`; it takes a number.",
    ]


@pytest.mark.parametrize(
    ("tag", "value", "problem"),
    [
        (
            "Doubled",
            "no_such_package:NODE",
            "Node `Doubled` is installed as `no_such_package:NODE`, but there is no module `no_such_package`. Correct "
            "its name, or install the package that has it.",
        ),
        (
            "Doubled",
            "TEXT",
            f"Node `Doubled` is installed as `{__name__}:TEXT`, but that is a str. Name an instance of NodeType there.",
        ),
        (
            "Twice",
            "DOUBLED",
            f"Node `Twice` is installed as `{__name__}:DOUBLED`, but the tag of that is `Doubled`. Give both the same "
            "name.",
        ),
        ("Raising", "RAISING", f"Node `{__name__}:RAISING` raises ValueError while it is made: no time. Fix it."),
        (
            "Nothing",
            "NOTHING",
            f"Node `{__name__}:NOTHING` makes a NoneType instead of a Behaviour. Fix it.",
        ),
    ],
)
def test_errors_of_installed_nodes_are_sentences(install: Install, tag: str, value: str, problem: str) -> None:
    install(**{tag: value})
    assert problems_of(with_tree(f"<{tag}/>")) == [f"2: {problem}"]


def test_a_module_that_fails_is_named_with_its_line(
    install: Install, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "broken_nodes.py").write_text("x = 1\nx / 0\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    install(Broken="broken_nodes:NODE")
    (found,) = problems_of(with_tree("<Broken/>"))
    assert found.startswith("2: Node `Broken` is installed as `broken_nodes:NODE`, but its module cannot be loaded.")
    assert "broken_nodes.py:2` raises ZeroDivisionError" in found


def test_a_node_that_cannot_be_used_is_no_problem_of_a_file_without_it(install: Install) -> None:
    install(Doubled="no_such_package:NODE")
    assert problems_of(with_tree("<go/>")) == []


def test_an_installed_node_replaces_no_skill_and_no_node_of_ours(install: Install, mission: FakeMission) -> None:
    install(go="GO")
    loaded = mission_of(with_tree("<go/>"))
    assert isinstance(loaded.build(mission.context, loaded.Options()).root, SkillAction)
