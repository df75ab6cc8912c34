"""Systems of real processes, and a place of the tests' own where commands look for them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from command_line import Command, run_command

from skillwing.dsl import parse
from skillwing.services.testing import SkillsetProcesses


@pytest.fixture(scope="module")
def runtime(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A runtime directory of the tests' own, so that a system that runs here by chance is neither used nor hurt."""
    directory = tmp_path_factory.mktemp("runtime")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(directory))
        patch.delenv("SKILLWING_CONNECT", raising=False)
        yield directory


@pytest.fixture(scope="module")
def skillwing(runtime: Path) -> Command:
    """The command line, for which only what the tests start is there."""
    del runtime
    return run_command


@pytest.fixture(scope="module")
def mocked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[str, str], SkillsetProcesses]]:
    """Call it with a skillset and a mock script, as text: their managers run as processes until the module is over."""
    with ExitStack() as systems:

        def start(skillset: str, script: str) -> SkillsetProcesses:
            folder = tmp_path_factory.mktemp("mocked")
            source, played = folder / f"{parse(skillset).name}.skillset", folder / "mock.toml"
            source.write_text(skillset, encoding="utf-8")
            played.write_text(script, encoding="utf-8")
            return systems.enter_context(SkillsetProcesses(source, run_dir=folder / "run", scripts=[played]))

        yield start
