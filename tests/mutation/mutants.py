"""Mutants of the managers in a workspace of their own, made by mutmut."""

from __future__ import annotations

import shutil
from contextlib import chdir
from hashlib import sha256
from pathlib import Path

import msgspec
from rules import RULES

ROOT = Path(__file__).parents[2]
WORKSPACE = ROOT / "runs" / "mutation"
SERVICES = "skillwing/services"
MUTATED = (
    "core/*.py",
    "managers/lease_watch.py",
    "managers/leased_core.py",
    "managers/liveliness_monitor.py",
    "managers/registration.py",
    "managers/resource_manager.py",
    "client/retry.py",
    "client/goal_tracker.py",
    "client/causal_view.py",
    "client/causal_feed.py",
)
"""The cores, and where rules stand outside of them."""
_OF_RULES = {function for functions in RULES.values() for function in functions}
COPIED = (
    "conftest.py",
    "faulty_network.py",
    "law_settings.py",
    "scheduling.py",
    "unit/services",
    "unit/client",
    "integration",
    "simulation",
)


def make_mutants() -> dict[str, str]:
    """Write a workspace in which each function holds its mutants, and the name of one in the environment wakes it.

    Returns the mutants by name, with a fingerprint of the function that each is made of: all of the cores, and outside
    of them those of functions in which a rule stands.
    """
    source, target = ROOT / "services" / SERVICES, WORKSPACE / "src" / SERVICES
    _copy(source, target)
    for name in COPIED:
        _copy(ROOT / "tests" / name, WORKSPACE / "tests" / name)
    (WORKSPACE / "pyproject.toml").write_text(
        '[tool.pytest.ini_options]\nmarkers = ["slow: real processes or long simulations"]\n'
        '[tool.mutmut]\nsource_paths = ["src"]\n'
    )
    mutants: dict[str, str] = {}
    for file in sorted(file for pattern in MUTATED for file in source.glob(pattern)):
        place = file.relative_to(source)
        module = ".".join((*Path(SERVICES).parts, *place.with_suffix("").parts))
        made = _mutated(file.read_text(encoding="utf-8"))
        (target / place).write_text(made.code, encoding="utf-8")
        mutants |= {f"{module}.{mutant}": fingerprint for mutant, fingerprint in made.mutants.items()}
    return {name: fingerprint for name, fingerprint in mutants.items() if ".core." in name or is_of_rule(name)}


def is_of_rule(mutant: str) -> bool:
    """A rule of the semantics stands in its function."""
    return function_of(mutant) in _OF_RULES


class Mutated(msgspec.Struct):
    """A file with its mutants. mutants: by their name in the module, with the fingerprint of their function."""

    code: str
    mutants: dict[str, str]


def _mutated(source: str) -> Mutated:
    """The mutants of a file, remembered: they take a second for each hundred."""
    memory = WORKSPACE / "made" / f"{sha256(source.encode()).hexdigest()}.json"
    if memory.exists():
        return msgspec.json.decode(memory.read_bytes(), type=Mutated)
    from mutmut.mutation.file_mutation import mutate_file_contents  # noqa: PLC0415 - every worker would collect it

    with chdir(WORKSPACE):  # where mutmut looks for its settings
        file = mutate_file_contents("", source)
    hashes = file.hash_by_function_name
    made = Mutated(file.code, {mutant: hashes[mutant.partition("__mutmut_")[0]] for mutant in file.mutant_names})
    memory.parent.mkdir(exist_ok=True)
    memory.write_bytes(msgspec.json.encode(made))
    return made


def function_of(mutant: str) -> str:
    """`SkillCore.start` for `skillwing.services.core.skill_core.xǁSkillCoreǁstart__mutmut_3`."""
    told = mutant.rsplit(".", 1)[1].split("__mutmut_", maxsplit=1)[0]
    return told.removeprefix("xǁ").replace("ǁ", ".") if "ǁ" in told else told.removeprefix("x_")


def module_of(mutant: str) -> str:
    return mutant.rsplit(".", 2)[1]


def _copy(source: Path, target: Path) -> None:
    if source.is_dir():
        shutil.rmtree(target, ignore_errors=True)
        shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
    else:
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, target)
