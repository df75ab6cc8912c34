"""Exported files keep the rules of BehaviorTree.CPP 4.10, as its `VerifyXML` checks them."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from skillwing.bt_missions.checking.mission_check import offline_context
from skillwing.bt_missions.mission.mission import Mission
from skillwing.bt_missions.missions import inspection, mapping
from skillwing.bt_missions.xml.writer import write_mission, write_models
from skillwing.dsl import load

ROOT = next(folder for folder in Path(__file__).parents if (folder / "pyproject.toml").exists())
M600 = load(ROOT / "services/skillwing/m600/m600.skillset")
MISSIONS = (mapping.MISSION, inspection.MISSION)
CONTROLS = {
    *("Sequence", "Fallback", "ReactiveSequence", "ReactiveFallback", "SequenceWithMemory", "Parallel", "IfThenElse"),
    *(f"Switch{cases}" for cases in range(2, 7)),
}
DECORATORS = {
    "Inverter",
    "ForceSuccess",
    "ForceFailure",
    "KeepRunningUntilFailure",
    "RetryUntilSuccessful",
    "Repeat",
    "Timeout",
    "Delay",
    "RunOnce",
}
ACTIONS = {"AlwaysSuccess", "AlwaysFailure"}
THEIRS = {
    **dict.fromkeys(CONTROLS, "Control"),
    **dict.fromkeys(DECORATORS, "Decorator"),
    **dict.fromkeys(ACTIONS, "Action"),
}
"""Nodes that the library knows by itself."""
FORBIDDEN = set(" \t\n\r<>&\"'/\\:*?|.")
RESERVED = {"ID", "name"}
CHILDREN = {
    "Action": lambda count: count == 0,
    "Condition": lambda count: count == 0,
    "Decorator": lambda count: count == 1,
    "Control": lambda count: count > 0,
}


def is_model_name(name: str) -> bool:
    return bool(name) and name != "Root" and not FORBIDDEN & set(name)


def is_port_name(name: str) -> bool:
    return is_model_name(name) and name[0].isalpha() and name not in RESERVED


def models_of(root: ElementTree.Element) -> dict[str, ElementTree.Element]:
    (models,) = root.iter("TreeNodesModel")
    return {model.attrib["ID"]: model for model in models}


@pytest.fixture(params=MISSIONS, ids=lambda mission: mission.name)
def exported(request: pytest.FixtureRequest) -> ElementTree.Element:
    mission: Mission = request.param
    trees = mission.build(offline_context(M600), mission.Options())
    return ElementTree.fromstring(write_mission(mission.name, trees, M600))


def test_names_of_models_and_ports_are_ones_that_the_library_takes() -> None:
    models = models_of(ElementTree.fromstring(write_models(M600)))
    assert {skill.name for skill in M600.skills} < set(models)
    for name, model in models.items():
        assert is_model_name(name)
        assert name not in THEIRS
        assert model.tag in CHILDREN
        ports = [port.attrib["name"] for port in model]
        assert len(set(ports)) == len(ports)
        assert all(map(is_port_name, ports))
        assert {port.tag for port in model} <= {"input_port", "output_port", "inout_port"}


def test_the_main_tree_is_there_and_no_tree_has_the_name_of_a_node(exported: ElementTree.Element) -> None:
    assert exported.attrib["BTCPP_format"] == "4"
    trees = [tree.attrib["ID"] for tree in exported.iter("BehaviorTree")]
    assert exported.attrib["main_tree_to_execute"] in trees
    assert len(set(trees)) == len(trees)
    assert all(map(is_model_name, trees))
    assert not set(trees) & {*THEIRS, *models_of(exported)}


def test_every_node_is_known_with_its_ports_and_as_many_children_as_its_kind_has(exported: ElementTree.Element) -> None:
    models = models_of(exported)
    for tree in exported.iter("BehaviorTree"):
        assert len(tree) == 1
        for node in tree[0].iter():
            kind = THEIRS.get(node.tag) or models[node.tag].tag
            assert CHILDREN[kind](len(node)), node.attrib
            if node.tag in models:
                ports = {port.attrib["name"] for port in models[node.tag]}
                assert node.attrib.keys() <= {"name", *ports}, node.attrib


def test_what_a_node_writes_goes_to_an_entry_of_the_blackboard(exported: ElementTree.Element) -> None:
    outputs = {
        (name, port.attrib["name"])
        for name, model in models_of(exported).items()
        for port in model
        if port.tag == "output_port"
    }
    written = [text for node in exported.iter() for port, text in node.attrib.items() if (node.tag, port) in outputs]
    assert written
    assert all(text[0] == "{" and text[-1] == "}" and is_port_name(text[1:-1]) for text in written)


@pytest.mark.parametrize("mission", MISSIONS, ids=lambda mission: mission.name)
def test_trees_of_the_missions_that_come_with_it_have_names_that_it_takes(mission: Mission) -> None:
    file = ROOT / "bt_missions/skillwing/bt_missions/missions" / f"{mission.name}.xml"
    trees = [
        tree.attrib["ID"] for tree in ElementTree.fromstring(file.read_text(encoding="utf-8")).iter("BehaviorTree")
    ]
    assert len(trees) > 3
    assert all(map(is_model_name, trees))
