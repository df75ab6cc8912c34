from __future__ import annotations

import importlib
import json
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType

import msgspec
import pytest
import yaml

from skillwing import m600
from skillwing.dsl import Skillset, load, parse
from skillwing.dsl.generating.package import RobotFolder, generate, skillset_copy
from skillwing.dsl.generating.skeletons import skeletons

ROOT = Path(__file__).parents[3]
CASE = Path(__file__).parent / "cases" / "valid" / "everything.skillset"
M600 = Path(m600.__path__[0])
EXAMPLES = sorted((ROOT / "examples").glob("*/*.skillset")) + sorted((ROOT / "examples").glob("*/*.rl"))


def make(source: Path, folder: Path) -> Skillset:
    """The whole package of a robot, skeletons and all."""
    skillset = load(source)
    robot = RobotFolder(folder)
    robot.write_once(skeletons(skillset, folder.name))
    copy = skillset_copy(skillset, source, folder, source.read_text("utf-8"))
    robot.write({**generate(skillset, source, folder, robot.managed(skillset)), **copy})
    return skillset


def from_text(text: str, managed: tuple[str, ...] = ()) -> Mapping[str, str]:
    return generate(parse(text), Path("s.skillset"), Path("s"), managed)


# --- the m600 --------------------------------------------------------------------------------------------------------


def test_the_generated_code_of_the_m600_is_up_to_date() -> None:
    source = M600 / "m600.skillset"
    skillset, robot = load(source), RobotFolder(M600)
    products = generate(skillset, source, M600, robot.managed(skillset))
    assert robot.outdated(products) == (), "run `make generate`"
    assert robot.orphans(skillset) == (), "remove these managers, or rename them with their classes"
    assert skillset_copy(skillset, source, M600, "") == {}


def test_the_compose_file_has_the_managers_that_are_generated() -> None:
    root, fragment = ((ROOT / "docker-compose.yml").read_text(), (M600 / "generated" / "compose.yml").read_text())
    ours, generated = yaml.safe_load(root)["services"], yaml.safe_load(fragment)["services"]
    managers = {name for name in ours if name.endswith("_manager") or name.startswith("skill_")}
    assert generated.keys() == managers | {"router", "keys", "cli"}, "run `make generate`"
    for name, service in generated.items():
        own = ("command", "depends_on", "ports") if name in managers else ()
        for option in ("init", "restart", "stop_grace_period", "healthcheck", "image", "entrypoint", *own):
            assert ours[name].get(option) == service.get(option), (name, option)
        assert service.get("environment", {}).keys() <= ours[name].get("environment", {}).keys()


def test_the_compose_file_gives_each_service_the_keys_that_it_needs() -> None:
    text = yaml.safe_load((M600 / "generated" / "compose.yml").read_text())
    volumes = {name: service["volumes"] for name, service in text["services"].items()}
    authority = {name for name, given in volumes.items() if any("authority" in each for each in given)}
    writers = {name for name, given in volumes.items() if any(not each.endswith(":ro") for each in given)}
    assert authority == writers == {"keys"}
    assert text["services"]["keys"]["network_mode"] == "none"
    assert volumes["router"] == ["site_keys:/home/skillwing/keys:ro"]
    assert volumes["skill_land"] == ["..:/robot/m600:ro", "robot_keys:/home/skillwing/keys/robots:ro"]
    assert "--host=${HOST_ADDRESS:-127.0.0.1}" in text["services"]["keys"]["command"]
    assert text["services"]["router"]["ports"] == ["${HOST_ADDRESS:-127.0.0.1}:${ZENOH_PORT:-7447}:7447"]
    used = {each.partition(":")[0] for given in volumes.values() for each in given} - {".."}
    assert used == text["volumes"].keys()


# --- any skillset ----------------------------------------------------------------------------------------------------


def test_generation_is_deterministic_and_depends_on_no_place(tmp_path: Path) -> None:
    here, there = tmp_path / "a" / "robot", tmp_path / "b" / "robot"
    for folder in (here, there):
        make(CASE, folder)
    texts = [
        {path.relative_to(folder): path.read_text() for path in folder.rglob("*") if path.is_file()}
        for folder in (here, there)
    ]
    assert texts[0] == texts[1]
    assert load(CASE).schema_hash in texts[0][Path("generated/__init__.py")]


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The packages of every robot that there is, and of the case file with one of everything."""
    root = tmp_path_factory.mktemp("packages")
    copied = root / "m600.skillset"
    copied.write_text((M600 / "m600.skillset").read_text("utf-8"), encoding="utf-8")
    for source in (CASE, copied, *EXAMPLES):
        # A robot may be there in both languages.
        make(source, root / (f"{source.stem}_rl" if source.suffix == ".rl" else source.stem))
    for name, text in AWKWARD.items():
        source = root / f"{name}.skillset"
        source.write_text(text, encoding="utf-8")
        make(source, root / name)
    return root


# Names that the generated modules use themselves, or that differ in capitals and numbers only.
AWKWARD = {
    "awkward": """
skillset awkward {
    enum Literal { A B }
    type Goal { client: Literal = A  inputs: int8 }
    type Client { goal: Goal  literals: Literal[] }
    type Awkward { path: string = "a 'quote'" }
    type GPS { x: bool }
    type Fix10 { gps: GPS }
    type Fix9 { gps: GPS }
    data { client: Client  seed: Awkward  gps: GPS  nine: Fix9  ten: Fix10 }
    resource client { initial A  A -> B  B -> A  extern A -> B }
    event fire { guard resource=(client == A)  effect { client -> B } }
    skill resources {
        input { inputs: Goal  goal_id: string  signatures: Client  names: Awkward }
        output { output: Client }
        effect { take: client -> B  release: client -> A }
        precondition { free: resource=(client == A)  success take }
        interrupt { apply=release }
        result { success events: apply=release  failure A: apply=release }
    }
    skill seed { }
    skill signature { input { cause: Literal = B } result { DONE } }
}
""",
    "goal": """
skillset goal {
    type TABLE { x: bool }
    type Mode { x: bool }
    type Types { x: bool }
    data { table: TABLE  mode: Mode  types: Types }
    resource goal { initial A  A -> B  extern B -> A }
    skill skill {
        input { table: TABLE  mode: Mode  types: Types }
        progress=1.0 { table: TABLE }
        output { mode: Mode }
        effect { take: goal -> B }
        result { DONE: apply=take }
    }
    skill hooks { }
    skill skill_hooks { }
    skill scripted { input { x: int8 }  output { y: int8 }  result { DONE } }
    skill annotations { }
}
""",
    "client": "skillset client { data { goal: bool }  skill abstract { input { client: bool } } }",
    "datum": "skillset datum { data { datum: float64 }  skill connect { } }",
    "generator": "skillset generator { type Generator { x: bool }  data { generator: Generator }  skill runs { } }",
    "f": """
skillset F {
    type F { x: bool }
    type FData { f: F }
    type FSkills { f: F }
    type f10 { x: bool }
    type f9 { x: bool }
    type f09 { x: bool }
    data { a: F  b: FData  c: FSkills  d: f10  e: f9  f: f09 }
    resource r { initial A  extern A -> B }
    skill goto_ { result { DONE } }
    skill go_to { progress=1.0 { x: bool }  result { DONE } }
}
""",
}


def test_generated_code_passes_the_linter_and_the_type_checker_at_its_strictest(packages: Path) -> None:
    lint = [sys.executable, "-m", "ruff"]
    config = ["--config", str(ROOT / "pyproject.toml"), str(packages)]
    for command in ([*lint, "check", *config], [*lint, "format", "--check", *config]):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout
    (packages / "pyrightconfig.json").write_text(
        json.dumps({"typeCheckingMode": "strict", "pythonVersion": "3.11", "include": ["."]})
    )
    command = [sys.executable, "-m", "basedpyright", "-p", str(packages), "--pythonpath", sys.executable, "--warnings"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


@pytest.fixture
def everything(packages: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The generated types of the case file."""
    monkeypatch.syspath_prepend(str(packages))
    yield importlib.import_module("everything.generated.types")


def test_generated_types_carry_defaults_and_refuse_wrong_types(everything: ModuleType) -> None:
    inputs = msgspec.convert({"path": {"points": [], "corners": []}}, everything.MoveInputs)
    assert (inputs.height, inputs.count, inputs.mode, inputs.slow) == (5.0, 3, "FAST", False)
    assert inputs.path.mode is everything.Mode.SLOW
    for wrong in ({"path": {"points": [], "corners": []}, "count": "3"}, {"path": {}}, {"path": {}, "hight": 3}):
        with pytest.raises(msgspec.ValidationError):
            msgspec.convert(wrong, everything.MoveInputs)


def test_an_input_named_like_an_option_hides_it() -> None:
    source = "skillset s { skill k { input { cause: string }  result { DONE } } }"
    text = from_text(source)["interface.py"]
    assert "cause: str," in text
    assert "cause=cause" not in text
    assert "goal_id=goal_id" in text


def test_a_type_that_a_skill_hides_in_its_class_is_taken_from_the_module() -> None:
    source = (
        "skillset s { type Mode { x: bool }  skill Mode { input { mode: Mode } }  skill other { input { m: Mode } } }"
    )
    text = from_text(source)["interface.py"]
    assert "m: _types.Mode," in text
    assert "from . import types as _types\n" in text


# --- what happens on the disk ----------------------------------------------------------------------------------------

SOURCE = "skillset s { skill k { input { x: bool }  result { DONE } } skill other { result { DONE } } }"


def test_only_skills_with_a_file_get_a_manager(tmp_path: Path) -> None:
    source = tmp_path / "s" / "s.skillset"
    source.parent.mkdir()
    source.write_text(SOURCE)
    (tmp_path / "s" / "skills").mkdir()
    (tmp_path / "s" / "skills" / "k.py").write_text("")
    robot = RobotFolder(tmp_path / "s")
    assert robot.managed(parse(SOURCE)) == ("k",)
    products = generate(parse(SOURCE), source, robot.path, ("k",))
    assert "KManager" in products["processes.py"] and "OtherManager" not in products["processes.py"]
    assert "skill_k:" in products["compose.yml"] and "skill_other:" not in products["compose.yml"]


def test_a_changed_skillset_makes_the_code_outdated(tmp_path: Path) -> None:
    robot = RobotFolder(tmp_path / "s")
    robot.write(from_text(SOURCE))
    assert robot.outdated(from_text(SOURCE)) == ()
    changed = robot.outdated(from_text(SOURCE.replace("bool", "int8")))
    assert {path.name for path in changed} == {"__init__.py", "types.py", "interface.py", "aio.py"}


def test_what_is_no_longer_generated_goes_and_what_somebody_wrote_stays(tmp_path: Path) -> None:
    robot = RobotFolder(tmp_path / "s")
    robot.write({**from_text(SOURCE), "old.py": "# Generated from s.skillset\n"})
    mine = robot.generated / "mine.py"
    mine.write_text("MINE = 1\n")
    assert [path.name for path in robot.outdated(from_text(SOURCE))] == ["old.py"]
    robot.write(from_text(SOURCE))
    assert not (robot.generated / "old.py").exists()
    assert mine.read_text() == "MINE = 1\n"


def test_the_skeleton_of_progress_names_its_type() -> None:
    source = "skillset s { skill go_to { progress=1.0 { x: bool }  result { DONE } } }"
    assert "Return the progress as a `GoToFeedback`" in skeletons(parse(source), "s")["skills/go_to.py"]


def test_skeletons_are_written_once(tmp_path: Path) -> None:
    robot = RobotFolder(tmp_path / "s")
    files = skeletons(parse(SOURCE), "s")
    assert len(robot.write_once(files)) == len(files)
    manager = robot.path / "skills" / "k.py"
    manager.write_text("MINE = 1\n")
    assert robot.write_once(files) == ()
    assert manager.read_text() == "MINE = 1\n"


def test_managers_of_removed_skills_are_reported(tmp_path: Path) -> None:
    robot = RobotFolder(tmp_path / "s")
    robot.write_once(skeletons(parse(SOURCE), "s"))
    (robot.path / "skills" / "shared.py").write_text("from math import pi\n")
    (robot.path / "skills" / "broken.py").write_text("def\n")
    assert robot.orphans(parse(SOURCE)) == ()
    without = parse(SOURCE.replace("skill other { result { DONE } }", ""))
    assert robot.orphans(without) == (robot.path / "skills" / "other.py",)
