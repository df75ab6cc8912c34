"""Check of the values that nodes read from entries of a blackboard and from the robot's data."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

from py_trees.behaviour import Behaviour

from skillwing.bt_missions.checking.declared_values import Declared, case_misfit, field_at, misfit
from skillwing.bt_missions.checking.repetition import above, repeats
from skillwing.bt_missions.checking.tree_check import skill_of, skillset_of
from skillwing.bt_missions.leaves.blackboard_entry import BlackboardEntry
from skillwing.bt_missions.leaves.may_start import MayStart
from skillwing.bt_missions.leaves.placeholder import is_guessed
from skillwing.bt_missions.leaves.readings import LatestReading
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.subtrees.flow_control import ValueSwitch
from skillwing.dsl.model import Skillset, UnknownNameError


@dataclass(frozen=True, slots=True)
class EntryWriter:
    """A leaf that writes an entry. place: number of its tree and its position there; declared: what it writes, if
    known."""

    leaf: Behaviour
    place: tuple[int, int]
    declared: Declared | None


@dataclass(frozen=True, slots=True)
class EntryRead:
    """A value that a node reads in the run. name: of its port; misfit: problem of a value of a declared type."""

    node: Behaviour
    name: str
    value: object
    misfit: Callable[[Declared, str], str | None]


def entry_problems(trees: Iterable[Behaviour], skillset: Skillset) -> Iterator[tuple[Behaviour, str]]:
    """Each problem of a value that is read in the run, with its reader. The trees run one after the other."""
    placed = [((tree, index), node) for tree, root in enumerate(trees) for index, node in enumerate(_in_order(root))]
    writers: dict[BlackboardEntry, list[EntryWriter]] = {}
    for place, node in placed:
        for name, entry in _outputs(node).items():
            writers.setdefault(entry, []).append(EntryWriter(node, place, _output(node, name, skillset)))
    for place, node in placed:
        for read in () if is_guessed(node) else _reads(node, skillset):
            yield from ((node, problem) for problem in _problems_of(read, place, writers, skillset))


def _in_order(node: Behaviour) -> Iterator[Behaviour]:
    """A node and all below it, each before its children."""
    yield node
    for child in node.children:
        yield from _in_order(child)


def _outputs(node: Behaviour) -> Mapping[str, BlackboardEntry]:
    """Entries that a node writes. A leaf of one's own names them in `outputs`, as `SkillAction` does."""
    outputs = getattr(node, "outputs", None)
    items = outputs.items() if isinstance(outputs, Mapping) else ()
    return {str(name): entry for name, entry in items if isinstance(entry, BlackboardEntry)}


def _output(node: Behaviour, name: str, skillset: Skillset) -> Declared | None:
    skill = skill_of(node, skillset) if isinstance(node, SkillAction) else None
    return next((field for field in skill.outputs if field.name == name), None) if skill else None


def _reads(node: Behaviour, skillset: Skillset) -> Iterator[EntryRead]:
    if isinstance(node, ValueSwitch):
        yield EntryRead(node, "variable", node.variable, partial(case_misfit, node.cases))
    elif isinstance(node, SkillAction | MayStart):
        skill = skill_of(node, skillset)
        inputs = {field.name: field for field in skill.inputs} if skill else {}
        for name, value in (node.inputs or {}).items():
            yield EntryRead(node, name, value, partial(misfit, inputs[name]) if name in inputs else _accept)


def _accept(given: Declared, text: str) -> str | None:
    """No problem: the input is unknown, which is reported elsewhere."""
    return None


def _problems_of(
    read: EntryRead, place: tuple[int, int], writers: Mapping[BlackboardEntry, list[EntryWriter]], skillset: Skillset
) -> Iterator[str]:
    if isinstance(read.value, LatestReading):
        yield from _reading_problems(read.value, read, skillset)
    elif isinstance(read.value, BlackboardEntry):
        known = writers.get(read.value, [])
        text = f"{{{read.value.name}}}"
        found = (read.misfit(each.declared, text) for each in known if each.declared is not None)
        yield from dict.fromkeys(filter(None, found))
        yield from _order_problems(read, read.value, place, known)


def _reading_problems(reading: LatestReading, read: EntryRead, skillset: Skillset) -> Iterator[str]:
    try:
        given = field_at(skillset_of(reading, skillset).datum(reading.datum), reading.fields)
    except UnknownNameError as error:
        yield str(error)
    except LookupError as error:
        yield f"{error}."
    else:
        problem = read.misfit(given, f"{{data.{reading.path}}}")
        if problem is not None:
            yield problem


def _order_problems(
    read: EntryRead, entry: BlackboardEntry, place: tuple[int, int], writers: list[EntryWriter]
) -> Iterator[str]:
    """Problem of an entry without a value at its first read."""
    text = f"`{read.name}` reads `{{{entry.name}}}`"
    if not (entry.is_filled or entry.may_be_empty):
        yield f"{text}, which nothing fills; name it in the `outputs` of a leaf."
    elif entry.is_pending and writers and not any(_may_precede(each, read.node, place) for each in writers):
        first = writers[0].leaf.name
        yield f"{text} before `{first}` sets it; put `{first}` before this node."


def _may_precede(writer: EntryWriter, reader: Behaviour, place: tuple[int, int]) -> bool:
    """True if the writer may have ended before the read: it comes first, or both are repeated together."""
    if writer.place < place:
        return True
    around = {node.id for node in above(reader)}
    return writer.leaf is not reader and any(node.id in around and repeats(node) for node in above(writer.leaf))
