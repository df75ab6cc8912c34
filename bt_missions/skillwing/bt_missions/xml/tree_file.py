"""Tree file: its trees, the ports and metadata that models declare for them, and the main tree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from skillwing.bt_missions.xml.document import Element, FileProblem, TreeFileError, read_document
from skillwing.bt_missions.xml.node_type import Category
from skillwing.dsl.suggest import closest, listed

FORMAT = "4"
RESCUE = "rescue"
SUBTREE = "SubTree"
MAIN = "main_tree_to_execute"
_PARTS = ("BehaviorTree", "TreeNodesModel")
_MODELS = (SUBTREE, *Category)
_PORTS = ("input_port", "inout_port", "output_port")


@dataclass(frozen=True, slots=True)
class DeclaredPort:
    """A port of a tree, as its model declares it. default: None if there is none."""

    name: str
    kind: str
    default: str | None
    line: int


@dataclass(slots=True)
class TreeModel:
    """Declarations about a tree in a `<SubTree>` of `<TreeNodesModel>`."""

    ports: list[DeclaredPort] = field(default_factory=list[DeclaredPort])
    metadata: dict[str, str] = field(default_factory=dict[str, str])
    lines: dict[str, int] = field(default_factory=dict[str, int])
    """Line of each entry of the metadata."""


@dataclass(frozen=True, slots=True)
class TreeFile:
    """A file of format 4. main: ID of the main tree; trees: the top element of each tree by ID; models: declarations.

    problems: of the frame around the trees. A file with problems cannot run, but its trees can be checked, each
    under the name that is most likely intended. `main` may then be unknown. An element without a tag replaces the top
    of a tree that cannot be read.

    excerpts: marked lines of a file in another notation, by line and column of an element.
    """

    file: Path
    main: str
    trees: Mapping[str, Element]
    models: Mapping[str, TreeModel]
    problems: tuple[FileProblem, ...] = ()
    excerpts: Mapping[tuple[int, int], str] = field(default_factory=dict[tuple[int, int], str])

    @property
    def main_model(self) -> TreeModel:
        return self.models.get(self.main, TreeModel())


def read_tree_file(file: Path) -> TreeFile:
    """Read a file of format 4. Raises TreeFileError for other files; the trees are checked later."""
    return tree_file(read_document(file), file)


def tree_file(root: Element, file: Path) -> TreeFile:
    """The trees of a document. Raises TreeFileError."""
    problems: list[FileProblem] = []
    if root.tag != "root" or root.attributes.get("BTCPP_format") != FORMAT:
        raise TreeFileError(file, [FileProblem(root.line, f'Begin with `<root BTCPP_format="{FORMAT}">`.')])
    trees: dict[str, Element] = {}
    models: dict[str, TreeModel] = {}
    nameless: list[Element] = []
    described: list[Element] = []
    for child in root.children:
        match _part(child, problems):
            case "BehaviorTree":
                _add_tree(child, trees, nameless, problems)
            case "TreeNodesModel":
                described += child.children
            case _:
                pass
    main = _main(root, trees, nameless, problems)
    _find_rescue(root, main, trees, nameless, problems)
    for each in (_as_meant(model, trees, problems) for model in described):
        models[_described(each, root, main, trees, models, problems)] = _model(each, problems)
    return TreeFile(file, main, trees, models, tuple(problems))


def _part(element: Element, problems: list[FileProblem]) -> str | None:
    """The kind of a part of the file, or the kind that is most likely intended."""
    near = None if element.tag == "include" else closest(element.tag, _PARTS)
    if element.tag == "include":
        problems.append(FileProblem(element.line, "Files are not included; put all trees into this one."))
    elif near is None:
        problems.append(FileProblem(element.line, f"`{element.tag}` does not belong here; put it into a BehaviorTree."))
    elif near != element.tag:
        problems.append(FileProblem(element.line, f"`{element.tag}` does not belong here; did you mean `{near}`?"))
    return near


def _add_tree(
    element: Element, trees: dict[str, Element], nameless: list[Element], problems: list[FileProblem]
) -> None:
    name = _attributes(element, ("ID",), problems).get("ID")
    top = element.children[0] if len(element.children) == 1 else Element("", {}, element.line, element.children)
    if not name:
        problems.append(FileProblem(element.line, "This tree has no ID; give it one."))
        nameless.append(top)
    elif name in trees:
        problems.append(FileProblem(element.line, f"There are two trees `{name}`; rename one of them."))
    else:
        trees[name] = top
        if top.tag == "":
            text = f"Tree `{name}` has {len(element.children)} nodes at its top; it takes one."
            problems.append(FileProblem(element.line, text))


def _attributes(element: Element, known: Sequence[str], problems: list[FileProblem]) -> dict[str, str]:
    """The attributes with these names, also if misspelt."""
    found = {name: text for name, text in element.attributes.items() if name in known}
    for name, text in element.attributes.items():
        near = closest(name, known)
        if name not in known and near is not None and near not in found:
            problems.append(FileProblem(element.line, f"`{element.tag}` has no `{name}`; did you mean `{near}`?"))
            found[near] = text
    return found


def _find_rescue(
    root: Element, main: str, trees: dict[str, Element], nameless: list[Element], problems: list[FileProblem]
) -> None:
    """Find the rescue under another name. Only the robot's table tells whether there has to be one."""
    if RESCUE not in trees and nameless:
        trees[RESCUE] = nameless.pop()
    near = closest(RESCUE, (name for name in trees if name != main and not name.startswith(f"{RESCUE}_")))
    if RESCUE in trees or near is None:
        return
    text = f"There is no tree `{RESCUE}`, which runs when somebody aborts the mission; did you mean `{near}` to be it?"
    problems.append(FileProblem(root.line, text))
    trees[RESCUE] = trees.pop(near)


def _as_meant(model: Element, trees: Mapping[str, Element], problems: list[FileProblem]) -> Element:
    """A model with a known kind. One of an unknown kind with the name of a tree describes that tree."""
    if model.tag in _MODELS:
        return model
    near = closest(model.tag, _MODELS) or (SUBTREE if model.attributes.get("ID") in trees else None)
    hint = f"did you mean `{near}`?" if near else f"write one of {listed(_MODELS)}."
    problems.append(FileProblem(model.line, f"`{model.tag}` is no kind of model; {hint}"))
    return model if near is None else replace(model, tag=near)


def _described(
    element: Element,
    root: Element,
    main: str,
    trees: Mapping[str, Element],
    models: Mapping[str, TreeModel],
    problems: list[FileProblem],
) -> str:
    """The tree or node that a model describes; for an unknown tree, the nearest name."""
    if element.tag != SUBTREE:
        return element.attributes.get("ID", "")
    name = _attributes(element, ("ID",), problems).get("ID", "")
    if name in trees:
        return name
    if name == root.attributes.get(MAIN):
        return main
    near = closest(name, (tree for tree in trees if tree not in models))
    hint = f"did you mean `{near}`?" if near else f"there is {listed(trees)}."
    if not any(_calls(tree, name) for tree in trees.values()):
        problems.append(FileProblem(element.line, f"A model describes a tree `{name}`, which does not exist; {hint}"))
    return near or name


def _calls(element: Element, tree: str) -> bool:
    """True if the element, or one below it, calls this tree. Then the missing tree is reported at the call."""
    called = element.tag == SUBTREE and element.attributes.get("ID") == tree
    return called or any(_calls(child, tree) for child in element.children)


def _model(element: Element, problems: list[FileProblem]) -> TreeModel:
    model = TreeModel()
    for child in element.children:
        near = closest(child.tag, _PORTS) if element.tag == SUBTREE else None
        if near is not None and near != child.tag:
            problems.append(FileProblem(child.line, f"`{child.tag}` is no port; did you mean `{near}`?"))
        attributes = {} if near is None else _attributes(child, ("name", "type", "default"), problems)
        if "name" in attributes:
            kind, default = attributes.get("type", "string"), attributes.get("default")
            model.ports.append(DeclaredPort(attributes["name"], kind, default, child.line))
        for entry in child.children:
            model.metadata |= entry.attributes
            model.lines |= dict.fromkeys(entry.attributes, entry.line)
    return model


def _main(root: Element, trees: dict[str, Element], nameless: list[Element], problems: list[FileProblem]) -> str:
    """The main tree, or the tree that is most likely intended."""
    main = _attributes(root, (MAIN,), problems).get(MAIN)
    others = [name for name in trees if name != RESCUE]
    if main is None and len(others) == 1:
        return others[0]
    if main is not None and main not in trees and nameless:
        trees[main] = nameless.pop(0)
    if main is None or main not in trees:
        known = listed(others)
        problems.append(FileProblem(root.line, f"Name the main tree by `{MAIN}`; there is {known}."))
        return closest(main or "", others) or main or ""
    return main
