"""Tags around a route: the plan, the writer of its legs, the loop over its legs, and the check at its end."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import msgspec
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.blackboard_entry import BlackboardEntry
from skillwing.bt_missions.planning.detour import Position, RoutePlanner
from skillwing.bt_missions.planning.known_space import Area
from skillwing.bt_missions.planning.waypoints import PointAbove, Route, RouteFulfilled, WaypointWriter
from skillwing.bt_missions.subtrees.decorators import RepeatUntil
from skillwing.bt_missions.xml.node_type import NOWHERE, Category, NodeConfig, NodeType, Port, PortError
from skillwing.bt_missions.xml.skills import CRAB, PLAN, TARGET, UP
from skillwing.bt_missions.xml.values import attribute_text

_PLAN_PORT = Port("plan", "the current route", "Route")


class PlanRoute(Behaviour):
    """Marks the start of a route, which is planned when the tree is built. SUCCESS in the run."""

    def __init__(self, name: str, route: Route) -> None:
        super().__init__(name)
        self.route = route

    def update(self) -> Status:
        return Status.SUCCESS


def _make_plan(config: NodeConfig) -> Behaviour:
    area: Area | None = _converted(config, "area", Area | None, None)
    route = Route(config.context, RoutePlanner(_converted(config, "route", tuple[Position, ...], NOWHERE), area=area))
    config.output("plan").set(route)
    return PlanRoute(config.name, route)


def _converted(config: NodeConfig, port: str, kind: Any, instead: Any) -> Any:
    """A value of an option, or one written as JSON."""

    def use(value: object) -> Any:
        try:
            if isinstance(value, str):
                return msgspec.json.decode(value or "null", type=kind)
            return msgspec.convert(value, kind)
        except (msgspec.DecodeError, msgspec.ValidationError) as error:
            raise PortError(f"`{port}` is `{config.ports[port]}`, which cannot be read: {error}.") from error

    return config.value(port, use, instead)


def _describe_plan(node: Behaviour) -> Mapping[str, str] | None:
    if not isinstance(node, PlanRoute):
        return None
    planner = node.route.planner
    values = {"route": planner.route, "area": planner.known.area}
    return {**{port: msgspec.json.encode(value).decode() for port, value in values.items()}, "plan": PLAN}


class _Filling(Behaviour):
    """Mixin for a leaf that writes: after each write it becomes the source of its entries."""

    outputs: Mapping[BlackboardEntry, Callable[[], object]]

    def fill(self) -> None:
        for entry, source in self.outputs.items():
            entry.source = source

    def update(self) -> Status:
        status = super().update()
        if status is Status.SUCCESS:
            self.fill()
        return status


def _written_name(node: Behaviour, source: Callable[[], object], instead: str) -> str:
    """The entry that a leaf fills from `source`, as it is written. instead: for a leaf of a mission in Python."""
    outputs = node.outputs if isinstance(node, _Filling) else {}
    return next((f"{{{entry.name}}}" for entry, each in outputs.items() if each == source), instead)


class _FillingWriter(_Filling, WaypointWriter):
    pass


class _FillingPoint(_Filling, PointAbove):
    pass


def _make_writer(config: NodeConfig) -> Behaviour:
    route = config.route("plan")
    writer = _FillingWriter(config.name, config.context, route)
    writer.outputs = {config.output("target"): route.target, config.output("crab"): route.crab}
    writer.fill()  # Nodes that read these entries are built next, and need a source.
    return writer


def _describe_writer(node: Behaviour) -> Mapping[str, str] | None:
    if not isinstance(node, WaypointWriter):
        return None
    target, crab = _written_name(node, node.route.target, TARGET), _written_name(node, node.route.crab, CRAB)
    return {"plan": PLAN, "target": target, "crab": crab}


def _make_point_above(config: NodeConfig) -> Behaviour:
    above = _FillingPoint(config.name, config.context, config.number("height"))
    above.outputs = {config.output("target"): above.target}
    above.fill()
    return above


def _describe_point_above(node: Behaviour) -> Mapping[str, str] | None:
    if not isinstance(node, PointAbove):
        return None
    return {"height": attribute_text(node.height), "target": _written_name(node, node.target, UP)}


def _make_until(config: NodeConfig) -> Behaviour:
    route = config.route("plan")
    return RepeatUntil(config.name, route.is_done, config.children[0])


def _describe_until(node: Behaviour) -> Mapping[str, str] | None:
    if not isinstance(node, RepeatUntil):
        return None
    if getattr(node.done, "__func__", None) is not Route.is_done:
        raise PortError(f"`{node.name}` ends by Python code, which a tree file cannot hold.")
    return {"plan": PLAN}


PLANNING = (
    NodeType(
        "PlanRoute",
        Category.ACTION,
        _make_plan,
        _describe_plan,
        (
            Port("route", "waypoints, ENU, in m: an option, or JSON `[[x, y, z], ...]`", "Position[]"),
            Port("area", "west, south, east, north border of the detours; empty for none", "Area", ""),
            Port("plan", "the current route", "Route", output=True),
        ),
    ),
    NodeType(
        "WaypointWriter",
        Category.ACTION,
        _make_writer,
        _describe_writer,
        (
            _PLAN_PORT,
            Port("target", "end of the next leg", "Position", TARGET, output=True),
            Port("crab", "heading at which it lies in the plane of the LiDAR, rad", "double", CRAB, output=True),
        ),
    ),
    NodeType(
        "PointAbove",
        Category.ACTION,
        _make_point_above,
        _describe_point_above,
        (
            Port("height", "height of a point straight above the robot, in m", "double"),
            Port("target", "that point, or the robot's position if it is higher", "Position", UP, output=True),
        ),
    ),
    NodeType("UntilRouteDone", Category.DECORATOR, _make_until, _describe_until, (_PLAN_PORT,)),
    NodeType(
        "RouteFulfilled",
        Category.CONDITION,
        make=lambda config: RouteFulfilled(config.name, config.context, config.route("plan")),
        describe=lambda node: {"plan": PLAN} if isinstance(node, RouteFulfilled) else None,
        ports=(_PLAN_PORT,),
    ),
)
