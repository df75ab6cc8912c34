"""Leaves that check the robot, and leaves for switches between branches."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import cast

from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure, Success

from skillwing.bt_missions.leaves.branch_switch import NeverSwitched, NoteSwitch, WaitForSettled
from skillwing.bt_missions.leaves.conditions import SIGNS, DataCompare, ResourceIs, Sign
from skillwing.bt_missions.leaves.may_start import MayStart
from skillwing.bt_missions.xml.node_type import BOOLEANS, Category, NodeConfig, NodeType, Port, PortError
from skillwing.bt_missions.xml.values import attribute_text, read_attribute
from skillwing.dsl.model import UnknownNameError

PATIENCE = "10"


def _make_resource_is(config: NodeConfig) -> Behaviour:
    return ResourceIs(
        config.name,
        config.context,
        config.text("resource"),
        *config.words("states"),
        wait=config.number("wait"),
        question=config.boolean("question"),
    )


def _describe_resource_is(node: Behaviour) -> Mapping[str, str] | None:
    if not isinstance(node, ResourceIs):
        return None
    attributes = {"resource": node.resource, "states": " ".join(node.states)}
    if node.wait:
        attributes["wait"] = attribute_text(node.wait)
    return {**attributes, "question": "true"} if node.question else attributes


def _make_may_start(config: NodeConfig) -> Behaviour:
    skill = config.text("skill")
    inputs: dict[str, object] | None = config.value("inputs", lambda text: _inputs(config, skill, str(text)), {})
    return MayStart(
        config.name,
        config.context,
        skill,
        inputs or None,
        wait=config.number("wait"),
        question=config.boolean("question"),
    )


def _inputs(config: NodeConfig, skill: str, text: str) -> dict[str, object]:
    """Values of `target=1,2,3 speed=2`. Unknown names keep their text; the check of the mission reports them."""
    try:
        pairs = [word.partition("=") for word in shlex.split(text)]
    except ValueError as error:
        raise PortError(f"`inputs` is `{text}`, which has a quotation mark without another.") from error
    if not all(name and equals for name, equals, _ in pairs):
        raise PortError(f"`inputs` is `{text}`; it takes pairs like `target=1,2,3 speed=2`.")
    return {name: _input(config, skill, name, value) for name, _, value in pairs}


def _input(config: NodeConfig, skill: str, name: str, text: str) -> object:
    try:
        field = config.context.skillset.skill(skill).input(name)
    except UnknownNameError:
        return text
    return read_attribute(text, field.type, name)


def _describe_may_start(node: Behaviour) -> Mapping[str, str] | None:
    if not isinstance(node, MayStart):
        return None
    attributes = {"skill": node.skill}
    for name, value in (node.inputs or {}).items():
        if callable(value):
            raise PortError(f"`{node.name}` takes `{name}` from Python code, which a tree file cannot hold.")
    if node.inputs:
        attributes["inputs"] = shlex.join(f"{name}={attribute_text(value)}" for name, value in node.inputs.items())
    if node.wait:
        attributes["wait"] = attribute_text(node.wait)
    return {**attributes, "question": "true"} if node.question else attributes


def _make_data_compare(config: NodeConfig) -> Behaviour:
    sign = cast(Sign, config.choice("sign", SIGNS))
    return DataCompare(config.name, config.context, config.text("datum"), sign, _plain(config.text("value")))


def _describe_data_compare(node: Behaviour) -> Mapping[str, str] | None:
    if not isinstance(node, DataCompare):
        return None
    return {"datum": ".".join([node.datum, *node.fields]), "sign": node.sign, "value": attribute_text(node.value)}


def _plain(text: str) -> float | str | bool:
    """A number or a boolean if the text is one; else the text."""
    if text.lower() in BOOLEANS:
        return BOOLEANS[text.lower()]
    try:
        return float(text)
    except ValueError:
        return text


def _describe_switch(node: Behaviour) -> Mapping[str, str] | None:
    return dict(zip(("subject", "before", "after"), node.step, strict=True)) if isinstance(node, NoteSwitch) else None


LOOKING = (
    NodeType(
        "ResourceIs",
        Category.CONDITION,
        _make_resource_is,
        _describe_resource_is,
        (
            Port("resource", "name of the resource"),
            Port("states", "states of which it has to be in one"),
            Port("wait", "longest wait for it, in seconds of robot time", "double", "0"),
            Port("question", "true: a failure is an answer, not the reason of a later failure", "bool", "false"),
        ),
    ),
    NodeType(
        "MayStart",
        Category.ACTION,
        _make_may_start,
        _describe_may_start,
        (
            Port("skill", "name of the skill"),
            Port("inputs", "its inputs, such as `target=1,2,3 speed=2`; without them they are not checked", default=""),
            Port("wait", "longest wait for it, in seconds of robot time", "double", "0"),
            Port("question", "true: a failure is an answer, not the reason of a later failure", "bool", "false"),
        ),
    ),
    NodeType(
        "DataCompare",
        Category.CONDITION,
        _make_data_compare,
        _describe_data_compare,
        (
            Port("datum", "name of the datum; `position.z` names a field"),
            Port("sign", "one of " + " ".join(SIGNS)),
            Port("value", "value to compare it with"),
        ),
    ),
    NodeType(
        "NoteSwitch",
        Category.ACTION,
        make=lambda config: NoteSwitch(
            config.name, config.context, config.text("subject"), config.text("before"), config.text("after")
        ),
        describe=_describe_switch,
        ports=(
            Port("subject", "subject of the switch"),
            Port("before", "branch that is left"),
            Port("after", "branch that takes over"),
        ),
    ),
    NodeType(
        "NeverSwitched",
        Category.CONDITION,
        make=lambda config: NeverSwitched(config.name, config.context, config.text("subject")),
        describe=lambda node: {"subject": node.subject} if isinstance(node, NeverSwitched) else None,
        ports=(Port("subject", "subject without a switch until now"),),
    ),
    NodeType(
        "Settled",
        Category.ACTION,
        make=lambda config: WaitForSettled(config.name, config.context, config.number("patience")),
        describe=lambda node: {"patience": attribute_text(node.patience)} if isinstance(node, WaitForSettled) else None,
        ports=(Port("patience", "longest wait for goals that stop, in seconds of robot time", "double", PATIENCE),),
    ),
    NodeType(
        "AlwaysSuccess",
        Category.ACTION,
        make=lambda config: Success(config.name),
        describe=lambda node: {} if isinstance(node, Success) else None,
        standard=True,
    ),
    NodeType(
        "AlwaysFailure",
        Category.ACTION,
        make=lambda config: Failure(config.name),
        describe=lambda node: {} if isinstance(node, Failure) else None,
        standard=True,
    ),
)
