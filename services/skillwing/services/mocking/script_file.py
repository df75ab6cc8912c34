"""Mock scripts in TOML files.

    seed = 1
    [skill.goto]
    runs = [{result = "BLOCKED", delay = 0.5}, {result = "ARRIVED"}]   # or `choices`, or one run's fields right here
    [data]
    battery = {from = 100.0, to = 0.0, over = 600.0}
    [resources]
    SDK_authority = "AVAILABLE"
    [[reaction]]
    when = {ends = "lift", with = "RAISED"}
    trigger = {fork = "UP"}

All problems of a file are reported at once.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, cast

import msgspec

from skillwing.dsl.model import Skillset
from skillwing.dsl.suggest import did_you_mean, listed
from skillwing.services.mocking.fitting import problems_of
from skillwing.services.mocking.script import Choices, MockRun, MockScript, Reaction, ScriptError, When

S = TypeVar("S", bound=msgspec.Struct)
Report = Callable[[str], None]

TAKES: Mapping[str, str] = {
    "delay": 'seconds from 0 on, [lowest, highest], or {input = "NAME"}',
    "stop_delay": 'seconds from 0 on, or "never"',
    "after": "seconds from 0 on",
    "weight": "a number above 0",
    "with": "a text or a list of texts",
    "fire": "an event's name, or a list of them",
    "trigger": "states by resource",
    "end": "results by skill",
    "output": "values by field",
    "progress": "values by field",
    "set": "values by datum",
    "when": "a table",
}
PARTS = ("seed", "skill", "data", "resources", "reaction")


def load_script(path: str | Path, skillset: Skillset) -> MockScript:
    """Read a script for a skillset.

    Raises OSError if the file cannot be read, and ScriptError with all problems.
    """
    file = Path(path)
    try:
        table = tomllib.loads(file.read_text(encoding="utf-8"))
    except UnicodeDecodeError:
        raise ScriptError(f"`{file}`", ["It is not text in UTF-8; save it as that."]) from None
    except tomllib.TOMLDecodeError as error:
        reason, _, place = str(error).rpartition(" (at ")
        where = f"at {place.rstrip(')')}" if reason else "in it"
        raise ScriptError(f"`{file}`", [f"It is no TOML, and wrong {where}: {reason or error}."]) from error
    problems: list[str] = []
    script = read_script(table, problems.append)
    problems += problems_of(script, skillset)
    if problems:
        raise ScriptError(f"`{file}`", problems)
    return script


def load_scripts(paths: Iterable[str | Path], skillset: Skillset) -> MockScript:
    """Read scripts and join them. Entries of later scripts replace those of earlier ones. Raises as `load_script`."""
    script = MockScript()
    for path in paths:
        more = load_script(path, skillset)
        script = MockScript(
            skills={**script.skills, **more.skills},
            seed=script.seed if more.seed is None else more.seed,
            data=script.data | more.data,
            resources=script.resources | more.resources,
            reactions=script.reactions + more.reactions,
        )
    return script


def read_script(table: Mapping[str, Any], report: Report) -> MockScript:
    """The script in a table. Unreadable parts are reported and left out."""
    for name in table:
        if name not in PARTS:
            report(f"There is no `{name}` at the top{_hint(name, PARTS)}")
    seed = table.get("seed")
    if seed is not None and (not isinstance(seed, int) or isinstance(seed, bool)):
        report(f"seed is `{seed}`; it takes a whole number.")
        seed = None
    skills = _table(table, "skill", report)
    data = _table(table, "data", report)
    resources = _table(table, "resources", report)
    for name, state in resources.items():
        if not isinstance(state, str):
            report(f"resources.{name} is `{state}`; it takes a state's name.")
    return MockScript(
        skills={name: _read_runs(raw, f"skill.{name}", report) for name, raw in skills.items()},
        seed=seed,
        data=data,
        resources={name: state for name, state in resources.items() if isinstance(state, str)},
        reactions=tuple(_read_reactions(table.get("reaction", []), report)),
    )


def read_run(raw: Any, where: str, report: Report) -> MockRun:
    """One run. Unreadable parts are reported and left out."""
    return _read(MockRun, raw, where, report)


def _table(table: Mapping[str, Any], name: str, report: Report) -> dict[str, Any]:
    found = table.get(name, {})
    if isinstance(found, dict):
        return cast(dict[str, Any], found)
    report(f"{name} is `{found}`; it takes a table.")
    return {}


def _read_runs(raw: Any, where: str, report: Report) -> Sequence[MockRun]:
    if not isinstance(raw, dict):
        report(f"{where} is `{raw}`; it takes a table.")
        return ()
    given = cast(dict[str, Any], raw)
    forms = [form for form in ("runs", "choices") if form in given]
    if not forms:
        return (_read(MockRun, given, where, report, also=("runs", "choices")),)
    [form, *more] = forms
    for name in (*more, *(name for name in given if name not in forms)):
        report(f"{where} has both `{form}` and `{name}`. Put what a run says into the list `{form}`.")
    listed_runs = given[form]
    if not isinstance(listed_runs, list) or not listed_runs:
        report(f"{where}.{form} takes a list of runs, such as [{{delay = 2.0}}].")
        return ()
    items = enumerate(cast(list[Any], listed_runs))
    runs = [read_run(item, f"{where}.{form}[{n}]", report) for n, item in items]
    return Choices(runs) if form == "choices" else tuple(runs)


def _read_reactions(raw: Any, report: Report) -> list[Reaction]:
    if not isinstance(raw, list):
        report("reaction takes a list of tables, each under a heading [[reaction]].")
        return []
    return [_read_reaction(item, f"reaction[{n}]", report) for n, item in enumerate(cast(list[Any], raw))]


def _read_reaction(raw: Any, where: str, report: Report) -> Reaction:
    if not isinstance(raw, dict):
        return _read(Reaction, raw, where, report)
    table = cast(dict[str, Any], raw)
    rest = {name: value for name, value in table.items() if name != "when"}
    reaction = _read(Reaction, rest, where, report)
    if "when" not in table:
        return reaction
    return msgspec.structs.replace(reaction, when=_read(When, table["when"], f"{where}.when", report))


def _read(kind: type[S], raw: Any, where: str, report: Report, also: tuple[str, ...] = ()) -> S:
    """Read a structure field by field, so that all its problems are found."""
    if not isinstance(raw, Mapping):
        report(f"{where} is `{raw}`; it takes a table.")
        return kind()
    fields = {each.encode_name: each for each in msgspec.structs.fields(kind)}
    values: dict[str, Any] = {}
    for name, value in cast(Mapping[str, Any], raw).items():
        if name not in fields:
            report(f"{where} has no `{name}`{_hint(name, (*fields, *also))}")
            continue
        try:
            values[fields[name].name] = msgspec.convert(value, fields[name].type)
        except msgspec.ValidationError:
            report(f"{where}.{name} is `{value}`; it takes {TAKES.get(name) or _of_type(fields[name].type)}.")
    return kind(**values)


def _of_type(kind: Any) -> str:
    return "true or false" if kind is bool else "a text"


def _hint(name: str, known: Sequence[str]) -> str:
    return did_you_mean(name, known, f"; there is {listed(known, limit=20)}.")
