"""Fixtures for pytest: each makes benches, as many as a test asks for, and closes them when the test is over.

Ask for them with `pytest_plugins = ["skillwing.services.testing.fixtures"]`, in a test module or the topmost
conftest. They are no installed plugin on purpose: whoever does not use them pays nothing.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import pytest

from skillwing.services.testing.bench import Bench
from skillwing.services.testing.in_process import SkillsetInProcess
from skillwing.services.testing.processes import SkillsetProcesses
from skillwing.services.testing.skill import SkillTest

B = TypeVar("B", bound=Bench)
P = ParamSpec("P")


@pytest.fixture
def benches() -> Iterator[ExitStack]:
    """Closes, in reverse order, the benches that were entered into it."""
    with ExitStack() as stack:
        yield stack


@pytest.fixture
def skill_test(benches: ExitStack) -> Callable[..., SkillTest[Any, Any, Any]]:
    """Call it as you would call `SkillTest`."""
    return _entering(benches, SkillTest[Any, Any, Any])


@pytest.fixture
def skillset_in_process(benches: ExitStack) -> Callable[..., SkillsetInProcess]:
    """Call it as you would call `SkillsetInProcess`."""
    return _entering(benches, SkillsetInProcess)


@pytest.fixture
def skillset_processes(
    benches: ExitStack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., SkillsetProcesses]:
    """Call it as you would call `SkillsetProcesses`, without `run_dir`: the logs are in the test's `tmp_path`.

    The processes can import what the test can, so that hooks may stand in a test module.
    """
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(path for path in sys.path if path))

    def make(skillset: str | Path, hooks: Mapping[str, str] | None = None, **options: Any) -> SkillsetProcesses:
        return benches.enter_context(SkillsetProcesses(skillset, hooks, run_dir=tmp_path, **options))

    return make


def _entering(benches: ExitStack, kind: Callable[P, B]) -> Callable[P, B]:
    """`kind`, with everything that it makes entered."""

    def make(*args: P.args, **kwargs: P.kwargs) -> B:
        return benches.enter_context(kind(*args, **kwargs))

    return make
