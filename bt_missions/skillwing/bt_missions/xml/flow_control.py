"""Tags of BehaviorTree.CPP for choices, delays and memory."""

from __future__ import annotations

from collections.abc import Mapping

from py_trees.behaviour import Behaviour
from py_trees.common import OneShotPolicy
from py_trees.decorators import OneShot

from skillwing.bt_missions.subtrees.decorators import Delay, RunOnce
from skillwing.bt_missions.subtrees.flow_control import IfThenElse, SequenceWithMemory, ValueSwitch
from skillwing.bt_missions.xml.node_type import Category, NodeConfig, NodeType, Port, PortError, milliseconds_text
from skillwing.bt_missions.xml.values import attribute_text, reference_text

MOST_CASES = 6
_CASE = "value for which the child at this place runs; the last child is for all else"


def _plain_text(value: object) -> str:
    return value if isinstance(value, str) else attribute_text(value)


def _switch(cases: int) -> NodeType:
    ports = [f"case_{number}" for number in range(1, cases + 1)]

    def make(config: NodeConfig) -> Behaviour:
        variable = config.live("variable") or config.value("variable", _plain_text, "")
        return ValueSwitch(config.name, variable, [config.text(port) for port in ports], config.children)

    def describe(node: Behaviour) -> Mapping[str, str] | None:
        if not isinstance(node, ValueSwitch) or len(node.cases) != cases:
            return None
        variable = reference_text(node.variable)
        if variable is None and callable(node.variable):
            raise PortError(f"`{node.name}` takes its variable from Python code, which a tree file cannot hold.")
        text = attribute_text(node.variable) if variable is None else variable
        return {"variable": text, **dict(zip(ports, node.cases, strict=True))}

    return NodeType(
        f"Switch{cases}",
        Category.CONTROL,
        make,
        describe,
        (
            Port("variable", "an entry, or a datum as `{data.NAME}`, whose value is compared with the cases"),
            *(Port(port, _CASE) for port in ports),
        ),
        standard=True,
        children=(cases + 1,),
    )


def _make_delay(config: NodeConfig) -> Behaviour:
    return Delay(config.name, config.context, config.seconds("delay_msec"), config.children[0])


def _make_run_once(config: NodeConfig) -> Behaviour:
    child = config.children[0]
    if config.boolean("then_skip"):
        return RunOnce(config.name, child)
    return OneShot(config.name, child, OneShotPolicy.ON_COMPLETION)


def _describe_run_once(node: Behaviour) -> Mapping[str, str] | None:
    if not isinstance(node, OneShot) or node.policy is not OneShotPolicy.ON_COMPLETION:
        return None
    return {"then_skip": attribute_text(isinstance(node, RunOnce))}


FLOW_CONTROL = (
    NodeType(
        "SequenceWithMemory",
        Category.CONTROL,
        make=lambda config: SequenceWithMemory(config.name, config.children),
        describe=lambda node: {} if isinstance(node, SequenceWithMemory) else None,
        standard=True,
    ),
    NodeType(
        "IfThenElse",
        Category.CONTROL,
        make=lambda config: IfThenElse(config.name, *config.children),
        describe=lambda node: {} if isinstance(node, IfThenElse) else None,
        standard=True,
        children=(2, 3),
    ),
    *(_switch(cases) for cases in range(2, MOST_CASES + 1)),
    NodeType(
        "Delay",
        Category.DECORATOR,
        _make_delay,
        describe=lambda node: {"delay_msec": milliseconds_text(node.seconds)} if isinstance(node, Delay) else None,
        ports=(Port("delay_msec", "milliseconds of robot time until the child starts", "unsigned"),),
        standard=True,
    ),
    NodeType(
        "RunOnce",
        Category.DECORATOR,
        _make_run_once,
        _describe_run_once,
        (Port("then_skip", "true: skipped after its first end; false: the same end each time", "bool", "true"),),
        standard=True,
    ),
)
