"""Nodes that share a process."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.m600.robot import ROBOT
from skillwing.services.names import DATA_MANAGER, RESOURCE_MANAGER
from skillwing.services.processes.colocation import MANAGERS, colocated, process_groups
from skillwing.services.robot import ProcessSpec

NAMES = tuple("abcdef")
specs = st.builds(
    ProcessSpec,
    name=st.sampled_from(NAMES),
    factory=st.just("module:make"),
    essential=st.booleans(),
    restart=st.sampled_from(["always", "never"]),
    host=st.sampled_from([None, "here", "there"]),
)


@given(st.lists(specs, max_size=len(NAMES), unique_by=lambda spec: spec.name))
@settings(max_examples=50)
def test_every_node_lives_in_exactly_one_process_which_is_needed_and_mortal_as_it(table: list[ProcessSpec]) -> None:
    found = process_groups(table)
    assert sorted(node.name for each in found for node in each.nodes) == sorted(spec.name for spec in table)
    assert len({each.name for each in found}) == len(found)
    for each in found:
        assert {node.host or node.name for node in each.nodes} == {each.name}
        assert each.essential == any(node.essential for node in each.nodes)
        assert (each.restart == "never") == any(node.restart == "never" for node in each.nodes)


def test_the_resource_manager_and_the_functional_layer_keep_their_own_processes() -> None:
    layer = ROBOT.functional_layer({})
    found = {each.name: each for each in process_groups(colocated((*layer, *ROBOT.managers())))}
    assert set(found) == {*(spec.name for spec in layer), RESOURCE_MANAGER, MANAGERS}
    hosted = [node.name for node in found[MANAGERS].nodes]
    assert hosted == [DATA_MANAGER, *(f"skill/{skill}" for skill in ROBOT.hooks)]
    assert found[MANAGERS].shared
    assert not found[RESOURCE_MANAGER].shared


def test_no_robot_goes_on_without_the_process_of_all_its_skills() -> None:
    shared = next(each for each in process_groups(colocated(ROBOT.managers())) if each.shared)
    assert shared.essential
    assert shared.restart == "always"
