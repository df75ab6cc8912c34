"""Reader of scenario files, TOML or JSON, with all checks that are possible before a flight."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import msgspec

from skillwing.sim_mujoco.scenario.fault_checks import fault_errors, require_library
from skillwing.sim_mujoco.scenario.field_errors import field_errors
from skillwing.sim_mujoco.scenario.format import Scenario


class ScenarioError(ValueError):
    """A scenario that cannot be used; `str()` gives the place and the cause of each error."""


def read_scenario(path: Path) -> Scenario:
    """The scenario in a file. Raises ScenarioError."""
    try:
        # Some editors put a byte order mark ahead of the text.
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not text"
        raise ScenarioError(f"the scenario {path} cannot be read: {why}") from error
    language, read = ("JSON", json.loads) if path.suffix == ".json" else ("TOML", tomllib.loads)
    try:
        content: object = read(text)
    except (json.JSONDecodeError, tomllib.TOMLDecodeError) as error:
        raise ScenarioError(f"the scenario {path} is no {language}: {error}") from error
    except ValueError as error:
        raise ScenarioError(f"the scenario {path} cannot be read: a number in it has thousands of digits") from error
    except RecursionError as error:
        raise ScenarioError(f"the scenario {path} cannot be read: sections or lists nest too deep in it") from error
    wrong = [*field_errors(content, Scenario), *fault_errors(content)]
    if wrong:
        text = f" {wrong[0]}" if len(wrong) == 1 else "".join(f"\n    {each}" for each in wrong)
        raise ScenarioError(f"the scenario {path} does not fit:{text}")
    scenario = msgspec.convert(content, Scenario)
    try:
        require_library(scenario.poses)
    except ImportError as error:
        raise ScenarioError(f"the scenario {path} does not fit: {error}") from error
    return scenario
