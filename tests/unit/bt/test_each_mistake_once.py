"""Each misspelt name is reported once, and no problem that only follows from it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.decorators import SuccessIsFailure

from skillwing.bt_missions.checking.mission_check import check_mission, offline_context
from skillwing.bt_missions.drone.flight import land_where_it_is, unless_the_pilot_flies
from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees, Progress
from skillwing.bt_missions.subtrees.composites import OnEnding, alongside, first_that_works, guarded, in_order
from skillwing.bt_missions.subtrees.pausing import StateChange, WhileGranted
from skillwing.bt_missions.xml.document import parse_document
from skillwing.bt_missions.xml.mission import XmlMission
from skillwing.bt_missions.xml.tree_file import tree_file
from skillwing.m600.robot import ROBOT

M600 = ROBOT.load_skillset()
DRONE = offline_context(M600)
FILE = Path("mission.xml")

TEMPLATE = (files("skillwing.bt_missions.drone.templates") / "template.xml").read_text(encoding="utf-8")
NAMES = {"resource", "states", "ended_by", "success_on", "failure_on", "ID", "type", "question", "_autoremap"}
"""Attributes whose words are names, apart from options, which are in braces or declared as a `name`."""
FREE = {"name", "default", "root", "Metadata", "MetadataFields"}
"""Tags and attributes that may hold any text, or that every tree file needs."""


@dataclass(frozen=True)
class Slot:
    """A name in a file, from `start` to before `end`. again: its start in the end tag, of a tag that has one."""

    start: int
    end: int
    again: int | None = None


def slots(text: str) -> list[list[Slot]]:
    """All names in which a mistake shows, tag by tag."""
    found: list[list[Slot]] = []
    unclosed: list[tuple[re.Match[str], list[Slot]]] = []
    for tag in re.finditer(r"<(/?)(\w+)((?:[^<>\"]|\"[^\"]*\")*)>", text):
        end, name, inside = tag.groups()
        if end:
            begun, names = unclosed.pop()
            names += [Slot(*begun.span(2), tag.start(2))] if name not in FREE else []
            continue
        found.append([] if name in FREE else list(_slots_in(name, tag.start(3), inside)))
        if not inside.endswith("/"):
            unclosed.append((tag, found[-1]))
        elif name not in FREE:
            found[-1].append(Slot(*tag.span(2)))
    return found


def _slots_in(tag: str, start: int, inside: str) -> Iterator[Slot]:
    """Slots in the attributes of a tag, whose text begins at `start`."""
    for attribute in re.finditer(r"(\w+)=\"([^\"]*)\"", inside):
        key, value = attribute.groups()
        if key not in FREE:
            yield Slot(start + attribute.start(1), start + attribute.end(1))
        for word in re.finditer(r"\w{2,}", value):
            if key in NAMES or value == f"{{{word[0]}}}" or (tag, key) == ("input_port", "name"):
                yield Slot(start + attribute.start(2) + word.start(), start + attribute.start(2) + word.end())


def misspelt(text: str, *chosen: Slot) -> str:
    """Text in which each of these names lacks a letter in its middle."""
    starts = [(start, slot) for slot in chosen for start in (slot.start, slot.again) if start is not None]
    for middle in sorted((start + (slot.end - slot.start) // 2 for start, slot in starts), reverse=True):
        text = text[:middle] + text[middle + 1 :]
    return text


def problems_of(text: str) -> list[str]:
    """Problems of a tree file for the drone."""
    mission = XmlMission(tree_file(parse_document(text.encode(), FILE), FILE))
    return [str(problem) for problem in check_mission(mission, M600, mission.Options(), ROBOT.rescue_goal)]


def test_any_typing_error_in_a_file_is_one_problem() -> None:
    assert problems_of(TEMPLATE) == []
    every = [slot for tag in slots(TEMPLATE) for slot in tag]
    assert len(every) > 70
    for slot in every:
        found = problems_of(misspelt(TEMPLATE, slot))
        assert len(found) == 1, (TEMPLATE[slot.start : slot.end], found)


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("SubTre", "`SubTre` is no kind of model; did you mean `SubTree`?"),
        ("Tree", "`Tree` is no kind of model; did you mean `SubTree`?"),
        ("Q", "`Q` is no kind of model; did you mean `SubTree`?"),
    ],
)
def test_a_model_of_no_kind_that_bears_the_name_of_a_tree_is_that_of_the_tree(kind: str, told: str) -> None:
    begin = TEMPLATE.index("<TreeNodesModel")
    text = TEMPLATE[:begin] + TEMPLATE[begin:].replace("SubTree", kind)
    line = text[: text.index(f"<{kind} ", begin)].count("\n") + 1
    assert problems_of(text) == [f"{FILE}:{line}: {told}"]


@pytest.mark.parametrize(
    ("model", "told"),
    [
        ('<Action ID="goto"/>', []),
        ('<Action ID="rescue"/>', []),
        ('<Acton ID="goto"/>', ["`Acton` is no kind of model; did you mean `Action`?"]),
        (
            '<Q ID="goto"/>',
            ["`Q` is no kind of model; write one of `SubTree`, `Control`, `Decorator`, `Action` and `Condition`."],
        ),
    ],
)
def test_models_of_nodes_may_stand_beside_it(model: str, told: list[str]) -> None:
    found = problems_of(TEMPLATE.replace("<TreeNodesModel>", f"<TreeNodesModel>{model}"))
    assert [each.partition(": ")[2] for each in found] == told


FLOWN = [tag for tag in slots(TEMPLATE[: TEMPLATE.index("<TreeNodesModel")]) if tag]
"""Names in tags of the trees. Names in the models are left out, as other names refer to them."""


def quoted_around(slot: Slot) -> str:
    """The whole value of the attribute that a slot lies in, or the slot's own word."""
    before, after = TEMPLATE[: slot.start], TEMPLATE[slot.end :]
    return before[before.rindex('"') + 1 :] + TEMPLATE[slot.start : slot.end] + after[: after.index('"')]


@settings(max_examples=40)
@given(st.data(), st.lists(st.sampled_from(FLOWN), min_size=2, max_size=4, unique_by=lambda tag: tag[0].start))
def test_errors_in_different_tags_are_as_many_problems(data: st.DataObject, tags: list[list[Slot]]) -> None:
    chosen = [data.draw(st.sampled_from(tag)) for tag in tags]
    words = {TEMPLATE[slot.start : slot.end] for slot in chosen}
    assume(len(words) == len(chosen))  # the same one twice would be right again, where it is a cell's
    assume(len({quoted_around(slot) for slot in chosen}) == len(chosen))  # a tree and its name are one mistake
    found = problems_of(misspelt(TEMPLATE, *chosen))
    assert len(found) == len(chosen), (words, found)


def skill(name: str, **outcomes: Status) -> SkillAction:
    return SkillAction(
        name, DRONE, name, {"target": {"x": 1, "y": 2, "z": 3}} if name == "goto" else {}, outcomes=outcomes
    )


def takeoff() -> SkillAction:
    return SkillAction("takeoff", DRONE, "takeoff", {"height": 4.0})


def handled(tree: Behaviour) -> Behaviour:
    return first_that_works("or land", tree, SuccessIsFailure("not done", land_where_it_is(DRONE)))


class Flight(Mission):
    """Mission that flies one tree."""

    name = "flight"
    summary = ""

    def __init__(self, root: Behaviour) -> None:
        self._root = root

    def build(self, context: MissionContext, options: MissionOptions) -> MissionTrees:
        return MissionTrees(self._root, land_where_it_is(context), Progress)


def landed_unless(*states: str, resource: str = "flight_status") -> Behaviour:
    look = ResourceIs("on the ground?", DRONE, resource, *states, question=True)
    return first_that_works("on the ground", look, skill("land"))


@pytest.mark.parametrize(
    ("tree", "told"),
    [
        (lambda: handled(in_order("flight", takeoff(), skill("goto"), skill("lnd"))), "no skill `lnd`"),
        (lambda: handled(in_order("flight", takeoff(), skill("qqq"), skill("land"))), "no skill `qqq`"),
        (lambda: handled(in_order("flight", skill("takeof"), skill("goto"), skill("land"))), "no skill `takeof`"),
        (
            lambda: handled(in_order("flight", takeoff(), skill("goto", sucess=Status.SUCCESS), skill("land"))),
            "no ending `sucess`",
        ),
        (
            lambda: in_order("look", skill("zed_depthmap", S_NODATA=Status.SUCCESS), skill("stream")),
            "no ending `S_NODATA`",
        ),
        (
            lambda: handled(in_order("flight", SkillAction("up", DRONE, "takeoff", {"hight": 4.0}), skill("land"))),
            "`hight`",
        ),
        (
            lambda: handled(in_order("flight", SkillAction("up", DRONE, "takeoff", {"qqq": 4.0}), skill("land"))),
            "`qqq`",
        ),
        (
            lambda: in_order(
                "up, down", SuccessIsFailure("x", handled(in_order("f", takeoff(), landed_unless("ON_GRND"))))
            ),
            "no state `ON_GRND`",
        ),
        (
            lambda: handled(in_order("f", takeoff(), landed_unless("ON_GROUND", resource="flihgt_status"))),
            "no resource `flihgt_status`",
        ),
        (
            lambda: WhileGranted(
                "granted",
                DRONE,
                handled(in_order("flight", takeoff(), skill("land"))),
                resource="SDK_autority",
                states=("AVAILABLE",),
                patience=1.0,
                ended_by=StateChange("flight_status", "ON_GROUND"),
            ),
            "no resource `SDK_autority`",
        ),
        (
            lambda: handled(in_order("f", OnEnding("or", skill("qqq"), ("S_BLOCKED",), skill("stream")))),
            "no skill `qqq`",
        ),
        (lambda: alongside("both", skill("qqq"), until=in_order("then", skill("stream"))), "no skill `qqq`"),
    ],
)
def test_an_error_in_python_is_one_problem(tree: Callable[[], Behaviour], told: str) -> None:
    found = check_mission(Flight(tree()), M600, MissionOptions(), ROBOT.rescue_goal)
    assert len(found) == 1, list(map(str, found))
    assert told in found[0].text


def test_other_problems_are_reported_with_a_typing_error() -> None:
    charged = ResourceIs("charged?", DRONE, "battery_status", "NORML")
    tree = unless_the_pilot_flies(DRONE, 9.0, guarded("all", charged, in_order("up", takeoff(), skill("goto"))))
    found = [problem.text for problem in check_mission(Flight(tree), M600, MissionOptions(), ROBOT.rescue_goal)]
    assert sum("no state `NORML`" in each for each in found) == 1
    assert any("may end in the air" in each for each in found)
