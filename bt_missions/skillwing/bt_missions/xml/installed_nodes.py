"""Node types of other packages, by entry points `skillwing.nodes`: the name is the tag, the object a `NodeType`."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from functools import cache
from importlib import metadata
from importlib.metadata import EntryPoint, EntryPoints

from py_trees.behaviour import Behaviour

from skillwing.bt_missions.xml.node_type import NodeConfig, NodeType, PortError
from skillwing.services.user_code_errors import exception_message, load_error_message

ENTRY_POINTS = "skillwing.nodes"


class UnusableNodeError(Exception):
    """An installed node type that cannot be used. `str()` has a sentence for the problem and one for the remedy."""


@cache
def entry_points(group: str) -> EntryPoints:
    """Entry points of a group. They are read once a process: a check of a tree file asks for them several times."""
    return metadata.entry_points(group=group)


def installed_nodes() -> list[NodeType]:
    """The installed node types that can be used, by name. Loading one imports its module.

    A tree file with the tag of another one gets the reason by `unusable_reason`.
    """
    found: list[NodeType] = []
    for entry in sorted(entry_points(group=ENTRY_POINTS), key=lambda entry: entry.name):
        with suppress(UnusableNodeError):
            found.append(_load(entry))
    return found


def unusable_reason(tag: str) -> str | None:
    """Reason why the installed node of this tag cannot be used; None if there is none, or if it can be used."""
    for entry in entry_points(group=ENTRY_POINTS):
        if entry.name != tag:
            continue
        try:
            _load(entry)
        except UnusableNodeError as error:
            return str(error)
    return None


def _load(entry: EntryPoint) -> NodeType:
    """The node type of an entry point. Raises UnusableNodeError."""
    try:
        kind: object = entry.load()
    except (Exception, SystemExit) as error:  # users' code may raise any exception
        raise _unusable(entry, load_error_message(entry.module, error)) from error
    if not isinstance(kind, NodeType):
        raise _unusable(entry, f"that is a {type(kind).__name__}. Name an instance of NodeType there.")
    if kind.tag != entry.name:
        raise _unusable(entry, f"the tag of that is `{kind.tag}`. Give both the same name.")
    return replace(kind, make=lambda config: _make(kind, config, entry))


def _unusable(entry: EntryPoint, reason: str) -> UnusableNodeError:
    return UnusableNodeError(f"Node `{entry.name}` is installed as `{entry.value}`, but {reason}")


def _make(kind: NodeType, config: NodeConfig, entry: EntryPoint) -> Behaviour:
    """Build a node. Raises PortError for any exception of its code."""
    try:
        node: object = kind.make(config)
    except PortError:
        raise
    except (Exception, SystemExit) as error:  # users' code may raise any exception
        raise PortError(exception_message(error, f"Node `{entry.value}`", " while it is made")) from error
    if isinstance(node, Behaviour):
        return node
    raise PortError(f"Node `{entry.value}` makes a {type(node).__name__} instead of a Behaviour. Fix it.")
