"""Memory of a node: the items in all containers that it references, directly or indirectly."""

from __future__ import annotations

from collections import deque
from types import FunctionType, MethodType, ModuleType
from typing import Any

CONTAINERS = (dict, list, tuple, set, frozenset, deque)
LEAVES = (str, bytes, int, float, bool, type(None), type, ModuleType)


def items_held(root: object) -> int:
    """Number of items in all containers within `root`, each container counted once."""
    seen: set[int] = set()
    waiting: list[Any] = [root]
    count = 0
    while waiting:
        item = waiting.pop()
        if isinstance(item, LEAVES) or id(item) in seen:
            continue
        seen.add(id(item))
        if isinstance(item, CONTAINERS):
            count += len(item)
        waiting += _parts(item)
    return count


def _parts(item: Any) -> list[Any]:
    match item:
        case dict():
            return [*item.keys(), *item.values()]
        case list() | tuple() | set() | frozenset() | deque():
            return list(item)
        case FunctionType():
            return [cell.cell_contents for cell in item.__closure__ or ()]
        case MethodType():
            return [item.__self__]
        case _:
            slots = {name for kind in type(item).__mro__ for name in getattr(kind, "__slots__", ())}
            held = [getattr(item, name, None) for name in slots if not name.startswith("__")]
            return [*held, *getattr(item, "__dict__", {}).values()]
