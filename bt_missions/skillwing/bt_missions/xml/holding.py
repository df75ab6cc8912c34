"""Tags for missions that stand still for a while: the safety pilot has the drone, or the operator has paused it."""

from __future__ import annotations

from collections.abc import Mapping

from py_trees.behaviour import Behaviour

from skillwing.bt_missions.subtrees.pausing import Change, Pausable, WhileGranted
from skillwing.bt_missions.xml.node_type import Call, Category, NodeType, Port, PortError
from skillwing.bt_missions.xml.values import written


def _make_while_granted(call: Call) -> Behaviour:
    def change(value: object) -> Change:
        words = str(value).split()
        if len(words) != 2:
            raise PortError(f"`ended_by` is `{value}`; it takes a resource and one of its states.")
        return Change(*words)

    resource, states = call.text("resource"), call.words("states")
    return WhileGranted(
        call.name,
        call.context,
        call.children[0],
        resource=resource,
        states=states,
        patience=call.number("patience"),
        ended_by=call.value("ended_by", change, Change(resource, next(iter(states), ""))),
    )


def _describe_while_granted(node: Behaviour) -> Mapping[str, str] | None:
    if not isinstance(node, WhileGranted):
        return None
    return {
        "resource": node.resource,
        "states": " ".join(node.states),
        "patience": written(node.patience),
        "ended_by": " ".join(node.ended_by),
    }


def _make_pausable(call: Call) -> Behaviour:
    condition, meanwhile, body = call.exactly(3)
    return Pausable(call.name, call.context, condition, meanwhile, body)


HOLDING = (
    NodeType(
        "WhileGranted",
        Category.DECORATOR,
        _make_while_granted,
        _describe_while_granted,
        (
            Port("resource", "name of the resource; skills that need it are held while it is in no other state"),
            Port("states", "in one of which it lets them fly"),
            Port("patience", "robot seconds for which it may stay away", "double"),
            Port("ended_by", "a resource and a state which, if it comes into it meanwhile, ends the mission"),
        ),
    ),
    NodeType(
        "Pausable",
        Category.CONTROL,
        _make_pausable,
        lambda node: {} if isinstance(node, Pausable) else None,
    ),
)
