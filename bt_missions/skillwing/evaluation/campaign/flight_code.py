"""The code that flies, as a digest: results of different code are never mixed."""

from __future__ import annotations

import ast
import hashlib
import platform
import sys
from collections.abc import Iterable, Iterator, Sequence
from importlib.metadata import version
from pathlib import Path
from types import CodeType
from typing import TypeVar, cast

import msgspec
from msgspec import Struct

from skillwing.dsl.whole_files import write_whole
from skillwing.services.errors import InvalidOptionError, SkillwingError

_Flight = TypeVar("_Flight")

CODE_FILE = "code.json"
PACKAGE = tuple(Path(portion) for portion in sys.modules["skillwing"].__path__)
"""Folders of the package, in a repository or where it was installed."""
PARTS = ("dsl", "services", "onboard", "m600", "sim_mujoco", "bt_missions", "evaluation/flights")
FLYING = (*(f"{part}/**/*" for part in PARTS), "evaluation/*")
"""Files of everything that flies. A test flies, and checks that every loaded module lies in one of them."""
SUFFIXES = {".py", ".skillset", ".xml", ".lark", ".json"}
LIBRARIES = ("av", "embreex", "llvmlite", "mujoco-core", "msgspec", "numba", "numpy", "py-trees", "scipy")
"""Libraries that compute in a flight."""
NAMES_SHOWN = 3
"""Number of changed files that a message names."""


class FlightCode(Struct, frozen=True):
    """files: digests of all files that fly, by path in the package, and versions of libraries by name."""

    files: dict[str, str]

    @property
    def digest(self) -> str:
        """Twelve hexadecimal digits, equal for equal code."""
        return _digest("\n".join(f"{name} {digest}" for name, digest in sorted(self.files.items())))

    def changes(self, other: FlightCode) -> list[str]:
        """Names that differ between the two."""
        return sorted(
            name for name in self.files.keys() | other.files.keys() if self.files.get(name) != other.files.get(name)
        )


class CodeChangedError(SkillwingError):
    """The code changed during a campaign, so that its flights are not all of one version."""

    def __init__(self, changes: list[str]) -> None:
        text = f"The code changed while it flew: {some_names(changes)}. Running flights are not kept. Start again."
        super().__init__(text)


class FlyingCode:
    """The package's code at this moment, which must not change during a campaign. code: its digests."""

    def __init__(self, package: Sequence[Path] = PACKAGE) -> None:
        self._package = package
        self._seen = _stamps(package)
        self.code = self._now = flight_code(package)

    def now(self) -> FlightCode:
        """The code on the disk now. Its digest takes seconds, so it is computed only if a file was touched."""
        if (seen := _stamps(self._package)) != self._seen:
            self._now, self._seen = flight_code(self._package), seen
        return self._now

    def kept(self, ended: Iterable[_Flight]) -> Iterator[_Flight]:
        """Flights as they end, as long as the code is the same. Raises CodeChangedError for the next after a change."""
        for flight in ended:
            if changes := self.code.changes(self.now()):
                raise CodeChangedError(changes)
            yield flight


def claim(folder: Path, code: FlightCode, *, begun: bool = False) -> None:
    """Reserve a folder for flights by this code. begun: it holds flights already.

    Raises InvalidOptionError if its flights are by other or unknown code.
    """
    path = folder / CODE_FILE
    if (begun or path.exists()) and (changes := code.changes(read_code(folder))):
        sentence = f"The flights in {folder} were flown by other code: {some_names(changes)}."
        raise InvalidOptionError("resume", f"{sentence} Start in another folder.")
    folder.mkdir(parents=True, exist_ok=True)
    write_whole(path, msgspec.json.encode(code))


def read_code(folder: Path) -> FlightCode:
    """The code whose flights are in a folder. Raises InvalidOptionError if the folder does not name it."""
    path = folder / CODE_FILE
    try:
        return msgspec.json.decode(path.read_bytes(), type=FlightCode)
    except (FileNotFoundError, msgspec.DecodeError) as error:
        text = f"{folder} does not name the code of its flights. Choose another folder."
        raise InvalidOptionError("output", text) from error


def flight_code(package: Sequence[Path] = PACKAGE) -> FlightCode:
    """Digests of the package's code as it is now. Comments and docstrings do not count."""
    files = {name: _digest(_executed(path)) for name, path in flying_files(package).items()}
    return FlightCode({**files, **_libraries(), "python": platform.python_version()})


def flying_files(package: Sequence[Path] = PACKAGE) -> dict[str, Path]:
    """Every file that can have a say in a flight, by its path in the package."""
    return {
        str(path.relative_to(portion)): path
        for portion in package
        for pattern in FLYING
        for path in sorted(portion.glob(pattern))
        if path.suffix in SUFFIXES
    }


def _libraries() -> dict[str, str]:
    return {name: version(name) for name in LIBRARIES}


def _stamps(package: Sequence[Path]) -> dict[str, object]:
    """Modification time and size of each file: quick evidence that nothing has changed."""
    found = ((name, path.stat()) for name, path in flying_files(package).items())
    return {**{name: (status.st_mtime_ns, status.st_size) for name, status in found}, **_libraries()}


def some_names(names: list[str]) -> str:
    """The first names of a list, and how many more there are."""
    more = f" and {len(names) - NAMES_SHOWN} more" if len(names) > NAMES_SHOWN else ""
    return ", ".join(names[:NAMES_SHOWN]) + more


def _executed(path: Path) -> str:
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        return text
    try:
        tree = ast.parse(text)
        tree.body = _without_texts(tree.body)
        code = compile(tree, "", "exec", dont_inherit=True)
    except SyntaxError:  # the file is being edited
        return text
    return "\n".join(_parts_executed(code))


def _without_texts(body: list[ast.stmt]) -> list[ast.stmt]:
    """Statements without docstrings, and without texts below constants; also in the statements within them."""
    kept = [each for each in body if not _is_text(each)]
    for statement in kept:
        for name in ("body", "orelse", "finalbody", "handlers", "cases"):
            if inner := getattr(statement, name, None):
                setattr(statement, name, _without_texts(inner))
    return kept or [ast.copy_location(ast.Pass(), each) for each in body[:1]]


def _parts_executed(value: object) -> Iterator[str]:
    """Parts of a code object or a constant that count, without line numbers."""
    if isinstance(value, CodeType):
        yield repr(
            (value.co_name, value.co_flags, value.co_argcount, value.co_posonlyargcount, value.co_kwonlyargcount)
        )
        yield repr((value.co_code, value.co_exceptiontable, value.co_names))
        yield repr((value.co_varnames, value.co_freevars, value.co_cellvars))
        for each in value.co_consts:
            yield from _parts_executed(each)
    elif isinstance(value, frozenset):
        yield from sorted(map(repr, cast("frozenset[object]", value)))  # in the same order in each process
    else:
        yield repr(value)


def _is_text(statement: ast.stmt) -> bool:
    """True for a docstring, and for the text below a constant."""
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:12]
