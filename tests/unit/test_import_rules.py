"""Allowed imports between parts (CONTRIBUTING.md), and packages that stay out of small images.

All imports count, those inside functions and under TYPE_CHECKING included.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from skillwing.m600.robot import ROBOT

ROOT = Path(__file__).parents[2]
PARTS = {
    "dsl": "dsl/skillwing/dsl",
    "services": "services/skillwing/services",
    "onboard": "services/skillwing/onboard",
    "m600": "services/skillwing/m600",
    "sim_mujoco": "sim_mujoco/skillwing/sim_mujoco",
    "bt_missions": "bt_missions/skillwing/bt_missions",
    "evaluation": "bt_missions/skillwing/evaluation",
}
ALLOWED = {
    "dsl": ["dsl"],
    "services": ["dsl", "services"],
    "onboard": [
        *("onboard", "services.protocol", "services.bus", "services.options"),
        *("services.wire.channel", "services.wire.messages", "services.wire.template"),
    ],
    "m600": ["dsl", "services", "m600", "onboard"],
    "sim_mujoco": ["sim_mujoco", "onboard", "services.protocol", "services.bus", "services.errors", "services.options"],
    "bt_missions": ["dsl", "services", "bt_missions"],
    "evaluation": ["dsl", "services", "onboard", "m600", "sim_mujoco", "bt_missions", "evaluation"],
}
OPTIONAL = {"recording", "report", "viewer"}
"""Folders of services for which the extra `viewer` is installed."""
HEAVY = {"numpy", "scipy", "numba", "mujoco", "embreex", "rerun", "matplotlib", "py_trees"}


def files(part: str) -> Iterator[Path]:
    return (ROOT / PARTS[part]).rglob("*.py")


def imports(path: Path, package: str) -> Iterator[str]:
    """Absolute names of everything that a file imports; of `from a import b` both `a` and `a.b`."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        match node:
            case ast.Import(names=names):
                yield from (alias.name for alias in names)
            case ast.ImportFrom(module=module, names=names, level=level):
                base = package.split(".")[: len(package.split(".")) - level + 1] if level else []
                origin = ".".join([*base, *([module] if module else [])])
                yield from (f"{origin}.{alias.name}" for alias in names)
            case _:
                pass


def package_of(path: Path) -> str:
    """The dotted package that a file's relative imports start from."""
    parts = path.relative_to(ROOT).parts
    return ".".join(parts[1:-1])


def within(name: str, allowances: list[str]) -> bool:
    return any(name == f"skillwing.{each}" or name.startswith(f"skillwing.{each}.") for each in allowances)


@pytest.mark.parametrize("part", PARTS)
def test_each_part_imports_only_what_it_may(part: str) -> None:
    trespasses = [
        f"{path.relative_to(ROOT)} imports {name}"
        for path in files(part)
        for name in imports(path, package_of(path))
        if name.split(".")[0] == "skillwing" and not within(name, ALLOWED[part])
    ]
    assert trespasses == [], f"Move the code to a part that may import it, or pass the values in: {ALLOWED[part]}"


@pytest.mark.parametrize("folder", sorted(OPTIONAL | {"history"}))
def test_what_a_run_leaves_behind_imports_no_command(folder: str) -> None:
    trespasses = [
        f"{path.relative_to(ROOT)} imports {name}"
        for path in (ROOT / PARTS["services"] / folder).rglob("*.py")
        for name in imports(path, package_of(path))
        if within(name, ["services.commands", "services.terminal"])
    ]
    assert trespasses == [], "Move what both need to services/history/, or pass it in."


def module_of(path: Path) -> str:
    name = f"{package_of(path)}.{path.stem}"
    return name.removesuffix(".__init__")


def needed_by(modules: Iterable[str]) -> dict[str, str]:
    """All modules that get imported, ours and others, each with one module that imports it."""
    paths = {module_of(path): path for part in PARTS for path in files(part)}
    found: dict[str, str] = {}
    open_modules = list(modules)
    while open_modules:
        module = open_modules.pop()
        for name in imports(paths[module], package_of(paths[module])):
            for each in (name, name.rpartition(".")[0]):
                if each and each not in found:
                    found[each] = module
                    open_modules += [each] if each in paths else []
    return found


def package_imports(part: str) -> dict[str, set[str]]:
    """The packages of a part, each with those that it imports. A module beside the packages counts as one."""
    home = f"skillwing.{part}."
    found: dict[str, set[str]] = {}
    for path in files(part):
        package = path.relative_to(ROOT / PARTS[part]).parts[0].removesuffix(".py")
        names = (name for name in imports(path, package_of(path)) if name.startswith(home))
        found.setdefault(package, set()).update(name.removeprefix(home).split(".")[0] for name in names)
    return {package: others - {package} for package, others in found.items()}


@pytest.mark.parametrize("part", PARTS)
def test_packages_of_a_part_import_each_other_in_one_direction(part: str) -> None:
    imported = package_imports(part)
    assert len(imported) > 1
    try:
        tuple(TopologicalSorter(imported).static_order())
    except CycleError as error:
        ring = " <- ".join(error.args[1])
        pytest.fail(f"Packages of {part} import each other in a ring: {ring}. Move what both need to one of them.")


def test_skill_managers_need_no_heavy_packages() -> None:
    """The bridge, the launcher and the command line need none either: the image of a manager holds them."""
    services = {module_of(path) for path in files("services") if OPTIONAL.isdisjoint(path.parts)}
    hooks = [path.partition(":")[0] for path in ROBOT.hooks.values()]
    needed = needed_by([*services, *hooks, "skillwing.m600.robot", "skillwing.m600.bridge.node"])
    assert "zenoh" in needed
    heavy = [f"{module} imports {name}" for name, module in needed.items() if name.split(".")[0] in HEAVY]
    assert heavy == [], "Pass the values in, or name the function by a string that only another image resolves."


@pytest.mark.parametrize("root", ["dsl", "services", "sim_mujoco", "bt_missions"])
def test_the_namespace_package_has_no_init_and_the_parts_have_one(root: str) -> None:
    assert not (ROOT / root / "skillwing" / "__init__.py").exists()
    for package in (ROOT / root / "skillwing").iterdir():
        if package.is_dir() and package.name != "__pycache__":
            assert (package / "__init__.py").exists()


def test_relative_and_nested_imports_are_seen(tmp_path: Path) -> None:
    source = "from . import a\nfrom .b import c\ndef f():\n    import skillwing.m600.robot\n    from ..x import y\n"
    file = tmp_path / "file.py"
    file.write_text(source, encoding="utf-8")
    assert list(imports(file, "skillwing.dsl")) == [
        "skillwing.dsl.a",
        "skillwing.dsl.b.c",
        "skillwing.m600.robot",
        "skillwing.x.y",
    ]
