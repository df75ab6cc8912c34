"""Which code flew: a digest of all that has a say in a flight, so that results of different code are never mixed."""

from __future__ import annotations

import ast
import hashlib
import platform
from collections.abc import Iterable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import TypeVar

import msgspec
from msgspec import Struct

from skillwing.evaluation.campaign.besides import BESIDES, ROOT
from skillwing.services.errors import InvalidOptionError, SkillwingError

_Flight = TypeVar("_Flight")

CODE_FILE = "code.json"
PORTIONS = ("dsl", "services", "sim_mujoco", "bt_missions")
"""Where the package lies in the repository."""
FLIES_NOTHING = (
    "bt_missions/at_a_terminal.py",
    "bt_missions/commands.py",
    "bt_missions/templates",
    "bt_missions/watching.py",
    "dsl/commands",
    "dsl/editor",
    "dsl/generating",
    "dsl/printing",
    "evaluation/campaign/again.py",
    "evaluation/campaign/command.py",
    "evaluation/campaign/crew.py",
    "evaluation/campaign/flight_code.py",
    "evaluation/campaign/ledger.py",
    "evaluation/campaign/outcomes.py",
    "evaluation/campaign/page.py",
    "evaluation/campaign/recordings.py",
    "evaluation/campaign/telling.py",
    "m600/commands.py",
    "evaluation/dashboard",
    "evaluation/demo",
    "evaluation/judge/flight_map.py",
    "services/commands",
    "services/diagnosis",
    "services/mocking",
    "services/recording",
    "services/report",
    "services/terminal",
    "services/testing",
    "services/viewer",
    "services/wire",
    "onboard/interface",
    "evaluation/judge/map_picture.py",
    "evaluation/judge/standing.py",
    "sim_mujoco/world/command.py",
    "sim_mujoco/world/picture.py",
)
"""Files of the package, and folders, of which no flight loads anything but to draw it. All else counts.

A test flies, and looks that all counts that was loaded."""
READ = {".py", ".skillset", ".xml", ".lark"}
LIBRARIES = ("av", "embreex", "mujoco-core", "msgspec", "numpy", "py-trees", "scipy")
"""What computes in a flight."""
NAMED = 3
"""So many changed files are told by name."""


class FlightCode(Struct, frozen=True):
    """files: digests of all that flies, by path in the repository, or by name and version of a library."""

    files: dict[str, str]

    @property
    def digest(self) -> str:
        """Twelve hexadecimal digits: the same for the same flights."""
        return _digest("\n".join(f"{name} {told}" for name, told in sorted(self.files.items())))

    def changes(self, other: FlightCode) -> list[str]:
        """What is not the same in both."""
        return sorted(
            name for name in self.files.keys() | other.files.keys() if self.files.get(name) != other.files.get(name)
        )


class CodeChangedError(SkillwingError):
    """The code changed while it flew: what was flown is not all of one version."""

    def __init__(self, changes: list[str]) -> None:
        text = f"The code has changed while it flew: {_some(changes)}. Flights under way are not kept. Begin anew."
        super().__init__(text)


class FlyingCode:
    """The code of the repository, as it is when this is made and has to stay while it flies. code: what it is."""

    def __init__(self, root: Path = ROOT) -> None:
        self._root = root
        self._seen = _touched(root)
        self.code = flight_code(root)

    def kept(self, ended: Iterable[_Flight]) -> Iterator[_Flight]:
        """Flights as they end, as long as the code is the same. Raises CodeChangedError for the first after a change.

        A digest of all takes seconds, so it is made only if files were touched.
        """
        for flight in ended:
            if (seen := _touched(self._root)) != self._seen:
                if changes := self.code.changes(flight_code(self._root)):
                    raise CodeChangedError(changes)
                self._seen = seen
            yield flight


def claim(folder: Path, code: FlightCode, *, begun: bool = False) -> None:
    """Make a folder one of flights by this code. begun: there are flights in it.

    Raises InvalidOptionError where other code has flown, or nobody knows which.
    """
    path = folder / CODE_FILE
    if (begun or path.exists()) and (changes := code.changes(read_code(folder))):
        sentence = f"What flies is not the code any more whose flights are in {folder}: {_some(changes)}."
        raise InvalidOptionError("resume", f"{sentence} Begin anew in another folder.")
    folder.mkdir(parents=True, exist_ok=True)
    path.write_bytes(msgspec.json.encode(code))


def read_code(folder: Path) -> FlightCode:
    """The code whose flights are in a folder. Raises InvalidOptionError where that is not written down."""
    path = folder / CODE_FILE
    try:
        return msgspec.json.decode(path.read_bytes(), type=FlightCode)
    except (FileNotFoundError, msgspec.DecodeError) as error:
        text = f"By which code the flights in {folder} were flown is not written down. Choose another folder."
        raise InvalidOptionError("output", text) from error


def flight_code(root: Path = ROOT) -> FlightCode:
    """Of the repository as it is now. What only people read, comments and docstrings, does not count.

    Where the package was installed without a repository its version stands for its files.
    """
    if not _has_sources(root):
        return FlightCode({"skillwing": version("skillwing"), **_libraries()})
    files = {str(path.relative_to(root)): _digest(_what_runs(path)) for path in flying_files(root)}
    return FlightCode({**files, **_libraries(), "python": platform.python_version()})


def flying_files(root: Path = ROOT) -> list[Path]:
    """Every file that may have a say in a flight."""
    flying = [path for name in BESIDES if (path := root / name).exists()]
    for package in (root / portion / "skillwing" for portion in PORTIONS):
        grounded = {package / each for each in FLIES_NOTHING}
        for path in package.rglob("*"):
            if path.suffix in READ and grounded.isdisjoint((path, *path.parents)):
                flying.append(path)
    return sorted(flying)


def _has_sources(root: Path) -> bool:
    return any((root / portion).is_dir() for portion in PORTIONS)


def _libraries() -> dict[str, str]:
    return {name: version(name) for name in LIBRARIES}


def _touched(root: Path) -> dict[str, object]:
    """What tells in little time that nothing has changed: when each file was written, and how large it is."""
    found = ((path, path.stat()) for path in (flying_files(root) if _has_sources(root) else ()))
    return {**{str(path): (status.st_mtime_ns, status.st_size) for path, status in found}, **_libraries()}


def _some(names: list[str]) -> str:
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


def _what_runs(path: Path) -> str:
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        return text
    try:
        tree = ast.parse(text)
    except SyntaxError:  # Somebody is still writing it.
        return text
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [each for each in node.body if not _is_text(each)]
    return ast.dump(tree)


def _is_text(statement: ast.stmt) -> bool:
    """A docstring, or one that describes the constant above it."""
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:12]
