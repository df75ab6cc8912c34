from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from lift_robot import forget, make_package


@pytest.fixture(scope="session")
def package(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The lift's package, importable as `lift`."""
    folder = tmp_path_factory.mktemp("robots") / "lift"
    make_package(folder)
    sys.path.append(str(folder.parent))
    yield folder
    sys.path.remove(str(folder.parent))
    forget("lift")


@pytest.fixture
def generated(package: Path) -> Any:
    """Imports a generated module of the lift by its name; untyped, since the package is there for the tests only."""
    return lambda name: importlib.import_module(f"{package.name}.generated.{name}")
