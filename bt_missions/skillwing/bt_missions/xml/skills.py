"""Tags for the skills of a skillset: the inputs and outputs of a skill are its ports."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.blackboard_entry import BlackboardEntry
from skillwing.bt_missions.leaves.skill_action import DEFAULT_PATIENCE, SkillAction
from skillwing.bt_missions.planning.waypoints import PointAbove, Route
from skillwing.bt_missions.xml.node_type import Category, NodeConfig, NodeType, Port, PortError
from skillwing.bt_missions.xml.values import attribute_text, read_attribute, reference_text
from skillwing.dsl.model import ArrayType, Field, Skill, Skillset, Type
from skillwing.services.core.values import type_text

TARGET, CRAB, PLAN, UP = "{target}", "{crab}", "{plan}", "{up}"
"""Entries of a written tree for the outputs of a WaypointWriter and a PointAbove."""
_OWN_PORTS = (
    Port("success_on", "endings that are SUCCESS, such as `S_ARRIVED S_BLOCKED`; by default its successes", default=""),
    Port("failure_on", "endings that are FAILURE; by default all others", default=""),
    Port("patience", "longest wait for resources, in robot seconds", "double", attribute_text(DEFAULT_PATIENCE)),
    Port("leg_of", "the plan that receives the end of this leg", default=""),
    Port("done", "inputs that a held goal works off, with the feedback that counts it: `laps=laps_done`", default=""),
)
_RESERVED = ("name", "ID", "robot", *(port.name for port in _OWN_PORTS))


def skill_types(skillset: Skillset) -> Iterator[NodeType]:
    """The tags of all skills, in the order of the skillset."""
    for skill in skillset.skills:
        yield _skill_type(skill)


def input_port(name: str) -> str:
    """The port of an input. An underscore follows a name that has another meaning in a tag."""
    return f"{name}_" if name in _RESERVED else name


def output_port(skill: Skill, name: str) -> str:
    """The port of an output. An underscore follows a name that has another meaning in the tag, such as an input's."""
    taken = (*_RESERVED, *(input_port(field.name) for field in skill.inputs))
    while name in taken:
        name = f"{name}_"
    return name


def _skill_type(skill: Skill) -> NodeType:
    # Limits are left out: the skill manager and the preflight check them.
    inputs = tuple(
        Port(input_port(field.name), _about(field), type_name(field.type), _default(field)) for field in skill.inputs
    )
    outputs = tuple(
        Port(output_port(skill, field.name), _about(field), type_name(field.type), "", output=True)
        for field in skill.outputs
    )
    return NodeType(
        skill.name,
        Category.ACTION,
        make=lambda config: _make(skill, config),
        describe=lambda node: _describe(skill, node),
        ports=(*inputs, *outputs, *_OWN_PORTS),
    )


def _about(field: Field) -> str:
    return f"{type_text(field.type)}{f', in {field.unit}' if field.unit else ''}"


def _default(field: Field) -> str:
    """The text of a port that is not given: the default of the skill, or nothing."""
    return "" if field.default is None else attribute_text(field.default)


def type_name(kind: Type) -> str:
    """The name of a type, as a port has it: `Pose`, `float64[]`."""
    return f"{type_name(kind.element)}[]" if isinstance(kind, ArrayType) else kind.name


def _make(skill: Skill, config: NodeConfig) -> Behaviour:
    inputs: dict[str, object] = {}
    for field in skill.inputs:
        port = input_port(field.name)
        live = config.live(port)
        if live is not None:
            inputs[field.name] = live
        elif config.entry(port) is not None or config.ports[port] != _default(field):

            def use(value: object, field: Field = field, port: str = port) -> object:
                return read_attribute(value if isinstance(value, str) else attribute_text(value), field.type, port)

            inputs[field.name] = config.value(port, use, BlackboardEntry(port).allow_empty())
    ports = {field.name: output_port(skill, field.name) for field in skill.outputs}
    outputs = {name: config.written(port) for name, port in ports.items() if config.ports[port]}
    outcomes = dict.fromkeys(config.words("success_on"), Status.SUCCESS)
    outcomes |= dict.fromkeys(config.words("failure_on"), Status.FAILURE)
    try:
        return SkillAction(
            config.name,
            config.context,
            skill.name,
            inputs,
            outputs=outputs,
            outcomes=outcomes,
            on_end=config.route("leg_of").leg_ended if config.ports["leg_of"] else None,
            done=_pairs(config, "done"),
            patience=config.number("patience"),
        )
    except ValueError as error:
        raise PortError(str(error)) from error


def _pairs(config: NodeConfig, port: str) -> dict[str, str]:
    """`a=b c=d` as a mapping."""
    pairs = [word.partition("=") for word in config.words(port)]
    if not all(name and equals and value for name, equals, value in pairs):
        config.problems.append(f"`{port}` is `{config.ports[port]}`; it takes pairs like `laps=laps_done`.")
        return {}
    return {name: value for name, _, value in pairs}


def _describe(skill: Skill, node: Behaviour) -> Mapping[str, str] | None:
    if not isinstance(node, SkillAction) or node.skill != skill.name:
        return None
    attributes = {input_port(name): _source(node, name) for name in node.inputs}
    attributes |= {output_port(skill, name): f"{{{entry.name}}}" for name, entry in node.outputs.items()}
    for port, status in (("success_on", Status.SUCCESS), ("failure_on", Status.FAILURE)):
        labels = [label for label, meaning in node.outcomes.items() if meaning is status]
        if labels:
            attributes[port] = " ".join(labels)
    if node.patience != DEFAULT_PATIENCE:
        attributes["patience"] = attribute_text(node.patience)
    if node.done:
        attributes["done"] = " ".join(f"{name}={feedback}" for name, feedback in node.done.items())
    if node.on_end is not None:
        if getattr(node.on_end, "__func__", None) is not Route.leg_ended:
            raise PortError(f"`{node.name}` calls Python code when it ends, which a tree file cannot hold.")
        attributes["leg_of"] = PLAN
    return attributes


def _source(node: SkillAction, name: str) -> str:
    """Attribute for an input of a leaf: its value or its entry."""
    value = node.inputs[name]
    if not callable(value):
        return attribute_text(value)
    outputs = {Route.target: TARGET, Route.crab: CRAB, PointAbove.target: UP}
    entry = reference_text(value) or outputs.get(getattr(value, "__func__", None))
    if entry is None:
        raise PortError(f"`{node.name}` takes `{name}` from Python code, which a tree file cannot hold.")
    return entry
