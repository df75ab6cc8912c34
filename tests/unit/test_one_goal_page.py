"""docs/one_goal.md names functions that exist, and the keys that they use."""

from __future__ import annotations

import ast
import re
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

import pytest

from skillwing.onboard.interface.table import TOPICS
from skillwing.services.protocol import Keys
from skillwing.services.wire.channels import CHANNELS

PAGE = Path(__file__).parents[2] / "docs" / "one_goal.md"
TEXT = PAGE.read_text(encoding="utf-8")
FUNCTION = re.compile(r"\[`([\w.]+)`\]\((\.\./[\w/]+\.py)\)")
KEY_ROW = re.compile(r"^\| `([^`]+)` \| `([\w.]+)` \| ([^|]+) \| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)
FUNCTIONS = sorted(set(FUNCTION.findall(TEXT)))
KEYS = KEY_ROW.findall(TEXT)
MODULES = ("flight", "guidance", "navigation")


@cache
def tree_of(file: str) -> ast.Module:
    return ast.parse((PAGE.parent / file).read_text(encoding="utf-8"))


def source_of(name: str, file: str) -> str | None:
    """The code of a function, or None if the file has no such function."""
    scope: ast.AST = tree_of(file)
    for part in name.split("."):
        found = [
            node
            for node in ast.iter_child_nodes(scope)
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == part
        ]
        if not found:
            return None
        scope = found[-1]
    return ast.unparse(scope)


def value_of(constant: str) -> str:
    """The key that a method of `Keys`, or a constant of the topics, stands for."""
    name = constant.removeprefix("Keys.")
    if name == constant:
        modules = [import_module(f"skillwing.onboard.topics.{topic}") for topic in MODULES]
        return next(getattr(module, name) for module in modules if hasattr(module, name))
    key = getattr(Keys("<skillset>"), name)
    return key if isinstance(key, str) else key("<resource>" if name == "resource" else "<skill>")


def class_names(kind: Any) -> frozenset[str]:
    """Names of a class of messages, or of those in a union."""
    return frozenset(each.__name__ for each in get_args(kind) or (kind,))


MESSAGES = {
    channel.spell(Keys("<skillset>"), f"<{channel.each}>"): {
        class_names(kind) for kind in (channel.message, channel.reply) if kind is not None
    }
    for channel in (*CHANNELS, *TOPICS)
}
"""Classes of publications, or of requests and replies, by key."""


def test_the_page_names_functions_and_keys() -> None:
    assert len(FUNCTIONS) > 60
    assert len(KEYS) > 15


@pytest.mark.parametrize(("name", "file"), FUNCTIONS)
def test_each_function_exists(name: str, file: str) -> None:
    assert source_of(name, file) is not None, f"{file} has no `{name}`: correct the row, or the way has changed"


@pytest.mark.parametrize(("key", "constant", "message", "senders", "receivers"), KEYS)
def test_both_sides_of_each_key_use_it(key: str, constant: str, message: str, senders: str, receivers: str) -> None:
    assert value_of(constant) == key
    assert {frozenset(re.findall(r"\w+", part)) for part in message.split("->")} == MESSAGES[key], f"see {key}"
    word = re.compile(rf"\b{constant.rpartition('.')[2]}\b")
    for name, file in FUNCTION.findall(senders) + FUNCTION.findall(receivers):
        assert word.search(source_of(name, file) or ""), f"`{name}` does not use {constant}"


def test_every_key_of_the_way_is_in_the_index() -> None:
    way = TEXT.partition("## Keys")[0]
    named = set(re.findall(r"`((?:<skillset>|fl)/[\w/<>]+)`", way))
    assert named <= {key for key, *_ in KEYS}
