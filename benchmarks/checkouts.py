"""Checkouts of this repository, whose code runs under the benchmarks of this one."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
IMPORT_ROOTS = ("dsl", "services", "sim_mujoco", "bt_missions")


def code_of(tree: Path) -> dict[str, str]:
    """Environment in which Python imports the packages of a checkout, and the benchmarks of this one."""
    path = [str(tree / root) for root in IMPORT_ROOTS]
    return {"PYTHONPATH": os.pathsep.join([*path, str(HERE)])}


def script(name: str, *arguments: str) -> list[str]:
    """Command that runs a script of this folder."""
    return [sys.executable, "-P", str(HERE / name), *arguments]


def first_module(*names: str) -> Any:
    """The first of some modules that the measured checkout has. Files moved between versions."""
    for name in names[:-1]:
        try:
            return importlib.import_module(name)
        except ModuleNotFoundError:
            continue
    return importlib.import_module(names[-1])


@contextmanager
def worktree(revision: str) -> Iterator[tuple[str, Path]]:
    """A temporary checkout of a revision: its short name and its folder. Raises ValueError for an unknown one."""
    found = subprocess.run(
        ["git", "rev-parse", "--verify", "--quiet", "--short", f"{revision}^{{commit}}"],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    if found.returncode:
        raise ValueError(f"There is no revision `{revision}` in this repository. Name a commit, branch or tag.")
    name = found.stdout.strip()
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "checkout"
        _git("worktree", "add", "--quiet", "--detach", str(tree), name)
        try:
            yield name, tree
        finally:
            _git("worktree", "remove", "--force", str(tree))


def _git(*arguments: str) -> None:
    subprocess.run(["git", *arguments], cwd=ROOT, check=True)
