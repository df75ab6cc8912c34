"""A tree file as a whole: its trees, the ports and metadata that models declare for them, and which one is flown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from skillwing.bt_missions.xml.document import Element, read_document
from skillwing.bt_missions.xml.problems import Problem, TreeFileError
from skillwing.dsl.suggest import listed

FORMAT = "4"
RESCUE = "rescue"


@dataclass(frozen=True, slots=True)
class DeclaredPort:
    """A port of a tree, as its model says. default: None where there is none."""

    name: str
    kind: str
    default: str | None
    line: int


@dataclass(slots=True)
class TreeModel:
    """What a `<SubTree>` in `<TreeNodesModel>` says of a tree."""

    ports: list[DeclaredPort] = field(default_factory=list[DeclaredPort])
    metadata: dict[str, str] = field(default_factory=dict[str, str])
    lines: dict[str, int] = field(default_factory=dict[str, int])
    """In which line each entry of the metadata is written."""


@dataclass(frozen=True, slots=True)
class TreeFile:
    """main: ID of the tree that is flown; trees: the top node of each tree by ID; models: what is declared of them.
    problems: of the frame around the trees. With any of them the file cannot be flown, and the trees can be checked all
    the same: `main` may then name none."""

    file: Path
    main: str
    trees: Mapping[str, Element]
    models: Mapping[str, TreeModel]
    problems: tuple[Problem, ...] = ()

    @property
    def main_model(self) -> TreeModel:
        return self.models.get(self.main, TreeModel())


def read_tree_file(file: Path) -> TreeFile:
    """Read a file of format 4. Raises TreeFileError for one that is none; trees are looked at later."""
    return tree_file(read_document(file), file)


def tree_file(root: Element, file: Path) -> TreeFile:
    """The trees of a document. Raises TreeFileError."""
    problems: list[Problem] = []
    if root.tag != "root" or root.attributes.get("BTCPP_format") != FORMAT:
        raise TreeFileError(file, [Problem(root.line, f'Begin with `<root BTCPP_format="{FORMAT}">`.')])
    trees: dict[str, Element] = {}
    models: dict[str, TreeModel] = {}
    for child in root.children:
        match child.tag:
            case "BehaviorTree":
                _add_tree(child, trees, problems)
            case "TreeNodesModel":
                models |= {each.attributes.get("ID", ""): _model(each) for each in child.children}
            case "include":
                problems.append(Problem(child.line, "Files are not included; put all trees into this one."))
            case tag:
                problems.append(Problem(child.line, f"`{tag}` does not belong here; put it into a BehaviorTree."))
    main = _main(root, trees, problems)
    if RESCUE not in trees:
        text = f'Add a `<BehaviorTree ID="{RESCUE}">`: what to do when somebody aborts the mission.'
        problems.append(Problem(root.line, text))
    return TreeFile(file, main, trees, models, tuple(problems))


def _add_tree(element: Element, trees: dict[str, Element], problems: list[Problem]) -> None:
    name = element.attributes.get("ID")
    if not name:
        problems.append(Problem(element.line, "This tree has no ID; give it one."))
    elif name in trees:
        problems.append(Problem(element.line, f"There are two trees `{name}`; rename one of them."))
    elif len(element.children) != 1:
        text = f"Tree `{name}` has {len(element.children)} nodes at its top; it takes one."
        problems.append(Problem(element.line, text))
        trees[name] = Element("AlwaysFailure", {}, element.line)
    else:
        trees[name] = element.children[0]


def _model(element: Element) -> TreeModel:
    model = TreeModel()
    for child in element.children:
        attributes = child.attributes
        if child.tag in ("input_port", "inout_port", "output_port") and "name" in attributes:
            kind, default = attributes.get("type", "string"), attributes.get("default")
            model.ports.append(DeclaredPort(attributes["name"], kind, default, child.line))
        for entry in child.children:
            model.metadata |= entry.attributes
            model.lines |= dict.fromkeys(entry.attributes, entry.line)
    return model


def _main(root: Element, trees: Mapping[str, Element], problems: list[Problem]) -> str:
    main = root.attributes.get("main_tree_to_execute")
    others = [name for name in trees if name != RESCUE]
    if main is None and len(others) == 1:
        return others[0]
    if main not in trees:
        known = listed(others)
        problems.append(Problem(root.line, f"Name the tree to fly by `main_tree_to_execute`; there is {known}."))
    return main or ""
