"""Writer of tree files that `builder.py` can build again, with a model of each node for the Groot2 editor."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from xml.etree import ElementTree

from py_trees.behaviour import Behaviour

from skillwing.bt_missions.leaves.blackboard_entry import BlackboardEntry
from skillwing.bt_missions.leaves.readings import LatestReading
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionTrees
from skillwing.bt_missions.planning.waypoints import WaypointWriter
from skillwing.bt_missions.subtrees.composites import in_order
from skillwing.bt_missions.xml.builder import ROBOT
from skillwing.bt_missions.xml.node_type import NodeType, PortError
from skillwing.bt_missions.xml.node_types import node_types
from skillwing.bt_missions.xml.plans import PlanRoute
from skillwing.bt_missions.xml.tree_file import FORMAT, RESCUE
from skillwing.dsl.model import Skillset
from skillwing.services.errors import SkillwingError

_MODELS = "TreeNodesModel"


class NotWritableError(SkillwingError):
    """A part of a tree is Python code, which a tree file cannot hold. problems: a sentence for each such node."""

    def __init__(self, problems: Iterable[str]) -> None:
        self.problems = tuple(problems)
        super().__init__(" ".join(self.problems))


def write_mission(name: str, trees: MissionTrees, skillset: Skillset) -> str:
    """A mission as a tree file, with the values of its options. Raises NotWritableError."""
    tops = {name: _with_plan(trees.root), RESCUE: trees.rescue}
    return _text(_written(name, tops, {"": node_types(skillset)}))


def write_mission_on_robots(mission: Mission, trees: MissionTrees, skillsets: Mapping[str, Skillset]) -> str:
    """The same for a mission on several robots. skillsets: by the names of the robots in the mission.

    Each tag of a robot names it. A file has no plan of waypoints for one of several robots. Raises NotWritableError.
    """
    tops = {mission.name: trees.root}
    tops |= {f"{RESCUE}_{robot}": top for robot in skillsets if (top := trees.rescue_of(robot)) is not None}
    nodes = [node for top in tops.values() for node in top.iterate()]
    planned = [node for node in nodes if isinstance(node, WaypointWriter | PlanRoute)]
    if planned:
        text = f"`{planned[0].name}` needs a plan, which a tree file of several robots cannot hold."
        raise NotWritableError([text])
    if foreign := [text for node in nodes for text in _foreign_readings(node)]:
        raise NotWritableError(foreign)
    root = _written(mission.name, tops, {robot: node_types(skillset) for robot, skillset in skillsets.items()})
    _append_metadata(root, mission)
    return _text(root)


def _written(
    name: str, tops: Mapping[str, Behaviour | None], types: Mapping[str, Mapping[str, NodeType]]
) -> ElementTree.Element:
    """The document of these trees, by their IDs. types: by robot; the only one has an empty name."""
    root = _document(name)
    used_tops = {tree: top for tree, top in tops.items() if top is not None}
    problems = list(_entry_problems(used_tops.values()))
    for tree, top in used_tops.items():
        _append(ElementTree.SubElement(root, "BehaviorTree", ID=tree), top, types, problems)
    if problems:
        raise NotWritableError(dict.fromkeys(problems))
    used = {element.tag for element in root.iter()}
    known = {tag: kind for own in types.values() for tag, kind in own.items()}
    _append_models(root, (kind for tag, kind in known.items() if tag in used))
    return root


def _foreign_readings(node: Behaviour) -> Iterator[str]:
    """Sentences about readings of another robot than that of their tag: `{data.NAME}` is one of the tag's own robot."""
    values = [*getattr(node, "inputs", {}).values(), getattr(node, "value", None)]
    for value in values:
        source = value.source if isinstance(value, BlackboardEntry) else value
        if isinstance(source, LatestReading) and source.robot != _robot_of(node):
            yield f"`{node.name}` reads data of `{source.robot}`, which a tag of another robot cannot."


def _robot_of(node: Behaviour) -> str:
    """Name of the robot of a node; empty for one of the mission as a whole."""
    context = getattr(node, "_context", None)
    return getattr(node, "robot", "") or getattr(context, "robot", "")


def _append_metadata(root: ElementTree.Element, mission: Mission) -> None:
    """Append the facts by which a file of several robots is read again."""
    facts = {"summary": mission.summary, "robots": " ".join(mission.robots)}
    facts["needs"] = "; ".join(f"{need}: {' '.join(states)}" for need, states in mission.needs.items())
    facts["owner_grace"] = f"{mission.owner_grace:g}" if mission.owner_grace else ""
    models = root.find(_MODELS)
    models = ElementTree.SubElement(root, _MODELS) if models is None else models
    fields = ElementTree.SubElement(ElementTree.SubElement(models, "SubTree", ID=mission.name), "MetadataFields")
    for key, text in facts.items():
        if text:
            ElementTree.SubElement(fields, "Metadata", {key: text})


def write_models(skillset: Skillset) -> str:
    """The models of all nodes that BehaviorTree.CPP does not have: the palette that Groot2 imports."""
    root = _document(None)
    _append_models(root, node_types(skillset).values())
    return _text(root)


def _document(main: str | None) -> ElementTree.Element:
    root = ElementTree.Element("root", BTCPP_format=FORMAT)
    if main is not None:
        root.set("main_tree_to_execute", main)
    return root


def _with_plan(top: Behaviour) -> Behaviour:
    """The tree with a PlanRoute at its start, which a mission in Python does not need. Raises NotWritableError."""
    nodes = list(top.iterate())
    routes = {node.route for node in nodes if isinstance(node, WaypointWriter | PlanRoute)}
    if len(routes) > 1:
        raise NotWritableError([f"`{top.name}` has {len(routes)} routes, and a tree file holds one."])
    if not routes or any(isinstance(node, PlanRoute) for node in nodes):
        return top
    return in_order("with a plan", PlanRoute("plan", routes.pop()), top)


def _entry_problems(tops: Iterable[Behaviour]) -> Iterator[str]:
    """Different entries with one name, of which a file would make one entry."""
    nodes = [node for top in tops for node in top.iterate()]
    leaves = [node for node in nodes if isinstance(node, SkillAction)]
    written = {entry for leaf in leaves for entry in leaf.outputs.values()}
    read = {value for leaf in leaves for value in leaf.inputs.values() if isinstance(value, BlackboardEntry)}
    counts = Counter(entry.name for entry in written | read)
    for name in dict.fromkeys(entry.name for entry in written):
        if counts[name] > 1:
            yield f"Two entries are called `{{{name}}}`; give them different names."


def _append(
    parent: ElementTree.Element, node: Behaviour, types: Mapping[str, Mapping[str, NodeType]], problems: list[str]
) -> None:
    tag, attributes = "AlwaysFailure", dict[str, str]()
    robot = "" if "" in types else _robot_of(node)
    try:
        tag, attributes = _described(node, types[robot or next(iter(types))])
    except PortError as error:
        problems.append(str(error))
    attributes |= {ROBOT: robot} if robot else {}
    element = ElementTree.SubElement(parent, tag, {"name": node.name, **attributes})
    for child in node.children:
        _append(element, child, types, problems)


def _described(node: Behaviour, types: Mapping[str, NodeType]) -> tuple[str, dict[str, str]]:
    for kind in types.values():
        attributes = kind.describe(node)
        if attributes is not None:
            defaults = {port.name: port.default for port in kind.ports if not port.output}
            return kind.tag, {name: text for name, text in attributes.items() if text != defaults.get(name)}
    raise PortError(f"`{node.name}` is a {type(node).__name__}, for which there is no tag.")


def _append_models(root: ElementTree.Element, types: Iterable[NodeType]) -> None:
    models = ElementTree.SubElement(root, _MODELS)
    for kind in types:
        if kind.standard:
            continue
        model = ElementTree.SubElement(models, kind.category, ID=kind.tag)
        for port in kind.ports:
            direction = "output_port" if port.output else "input_port"
            element = ElementTree.SubElement(model, direction, name=port.name, type=port.kind)
            if port.default:
                element.set("default", port.default)
            element.text = port.about or None


def _text(root: ElementTree.Element) -> str:
    ElementTree.indent(root, "  ")
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"
