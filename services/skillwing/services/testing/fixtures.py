"""Fixtures for pytest. Each makes benches for a test and closes them at its end.

Activate them by `pytest_plugins = ["skillwing.services.testing.fixtures"]`, in a test module or the topmost conftest.
They are not an installed plugin, so that other test runs do not load them.
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
    """An exit stack that closes its benches in reverse order."""
    with ExitStack() as stack:
        yield stack


@pytest.fixture
def skill_test(benches: ExitStack) -> Callable[..., SkillTest[Any, Any, Any]]:
    """A fixture with the arguments of `SkillTest`."""
    return _entering(benches, SkillTest[Any, Any, Any])


@pytest.fixture
def skillset_in_process(benches: ExitStack) -> Callable[..., SkillsetInProcess]:
    """A fixture with the arguments of `SkillsetInProcess`."""
    return _entering(benches, SkillsetInProcess)


@pytest.fixture
def skillset_processes(
    benches: ExitStack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., SkillsetProcesses]:
    """A fixture with the arguments of `SkillsetProcesses` except `run_dir`: logs are in the test's `tmp_path`.

    The processes can import all modules that the test can, so hooks may be in a test module.
    """
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(path for path in sys.path if path))

    def make(skillset: str | Path, hooks: Mapping[str, str] | None = None, **options: Any) -> SkillsetProcesses:
        return benches.enter_context(SkillsetProcesses(skillset, hooks, run_dir=tmp_path, **options))

    return make


def _entering(benches: ExitStack, kind: Callable[P, B]) -> Callable[P, B]:
    """`kind`, with all its benches entered into the stack."""

    def make(*args: P.args, **kwargs: P.kwargs) -> B:
        return benches.enter_context(kind(*args, **kwargs))

    return make
