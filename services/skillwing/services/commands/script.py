"""`skillwing script`: the scripts of the running system's mocks, and changes to them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

import msgspec
import typer
from rich.console import Console

from skillwing.dsl import UnknownNameError
from skillwing.services.errors import InvalidOptionError, NoReplyError, RefusedError, SkillwingError
from skillwing.services.mocking.script_file import read_run
from skillwing.services.mocking.wording import plan_texts
from skillwing.services.protocol import (
    DirectMock,
    ErrorCode,
    M,
    Message,
    MockedData,
    MockPlan,
    QueryMock,
    ResetMock,
    SetMockedData,
)
from skillwing.services.terminal.completion import skills_and_data
from skillwing.services.terminal.connection import JsonOption, RobotOption, System, connect
from skillwing.services.terminal.output import make_console, print_json, print_table, value_text

When = Literal["now", "next", "always"]


def script(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="SKILL|DATUM",
            help="Skill or datum to show or to change; all if left out.",
            autocompletion=skills_and_data,
        ),
    ] = None,
    words: Annotated[
        list[str] | None,
        typer.Argument(metavar="KEY=VALUE", help="As in result=BLOCKED delay=0.2, or for a datum value=12."),
    ] = None,
    next_goal: Annotated[bool, typer.Option("--next", help="Change the next goal; the default.")] = False,
    always: Annotated[bool, typer.Option("--always", help="Change all goals from now on.")] = False,
    now: Annotated[bool, typer.Option("--now", help="End the running goal so.")] = False,
    reset: Annotated[bool, typer.Option("--reset", help="Restart the script.")] = False,
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show what the mocks will do, or change it. See docs/mocks.md.

    `script` shows all, `script goto` one skill. `script goto result=BLOCKED delay=0.2` changes its next goal, and
    `script battery from=90 to=0 over=60` a datum from now on.

    Exit codes: 0 done, 1 it is not mocked, 2 unknown name or malformed value, 3 no system is running, 4 refused.
    """
    flags: tuple[tuple[When, bool], ...] = (("next", next_goal), ("always", always), ("now", now))
    chosen: list[When] = [when for when, flag in flags if flag]
    if len(chosen) + reset > 1:
        raise InvalidOptionError("next", "Give one of --next, --always, --now and --reset.")
    if (words or chosen) and name is None:
        raise InvalidOptionError("name", "Name what to change: `skillwing script SKILL KEY=VALUE`.")
    given = _read_words(words or [])
    if chosen and not given:
        raise InvalidOptionError("words", f"Give what --{chosen[0]} changes, as in `result=BLOCKED`.")
    if reset and given:
        raise InvalidOptionError("reset", "--reset restarts the script. Leave out the rest.")
    with connect(robot, wait_for_clock=False) as system:
        skills, data = _named(system, name)
        if given and skills:
            plans = [_direct(system, skills[0], given, chosen[0] if chosen else "next")]
        else:
            plans = [_ask_skill(system, each, ResetMock() if reset else QueryMock(), name) for each in skills]
        if given and data and not skills:
            values = _ask(system, system.keys.mocked_world, SetMockedData(data={data[0]: _signal(given)}), MockedData)
        else:
            values = _ask_world(system, ResetMock() if reset else QueryMock(), name) if data else None
    shown = {} if values is None else {each: values.values[each] for each in data}
    known = [plan for plan in plans if plan is not None]
    if as_json:
        print_json({"skills": {plan.skill: _plain(plan) for plan in known}, "data": shown})
    else:
        _print(make_console(), known, shown)


# --- words -----------------------------------------------------------------------------------------------------------


def _read_words(words: Sequence[str]) -> dict[str, Any]:
    """Nested values by key: `output.x=3` is a table in a table. Values are JSON, or else texts."""
    given: dict[str, Any] = {}
    for word in words:
        path, equals, text = word.partition("=")
        *parents, last = path.split(".")
        table = given
        for parent in parents:
            table = table.setdefault(parent, {})
            if not isinstance(table, dict):
                break
        if not equals or not last or not isinstance(table, dict) or last in table:
            raise InvalidOptionError("words", f"`{word}` cannot be used. Write KEY=VALUE, and each key once.")
        table[last] = _value(text)
    return given


def _value(text: str) -> Any:
    try:
        return msgspec.json.decode(text)
    except msgspec.DecodeError:
        return text


def _signal(given: dict[str, Any]) -> Any:
    """The signal of a datum: `value=12` is a plain 12."""
    return given["value"] if given.keys() == {"value"} else given


# --- asking ----------------------------------------------------------------------------------------------------------


def _named(system: System, name: str | None) -> tuple[list[str], list[str]]:
    """The skills and the data of a name; raises UnknownNameError."""
    skills = [skill.name for skill in system.skillset.skills]
    data = [item.name for item in system.skillset.data]
    if name is None:
        return skills, data
    if name not in skills and name not in data:
        raise UnknownNameError("skill or datum", name, (*skills, *data))
    return [each for each in skills if each == name], [each for each in data if each == name]


def _direct(system: System, skill: str, given: dict[str, Any], when: When) -> MockPlan:
    if when == "now":
        given = {"delay": 0.0, **given}
    problems: list[str] = []
    read_run(given, skill, problems.append)
    if problems:
        raise InvalidOptionError("words", " ".join(problems))
    return _ask(system, system.keys.mocked_skill(skill), DirectMock(run=given, when=when), MockPlan)


def _ask_skill(system: System, skill: str, message: Message, name: str | None) -> MockPlan | None:
    """The plan of a skill; None for one that is not mocked, unless the user has named it."""
    try:
        return _ask(system, system.keys.mocked_skill(skill), message, MockPlan)
    except _NotMockedError:
        if name is not None:
            raise
        return None


def _ask_world(system: System, message: Message, name: str | None) -> MockedData | None:
    try:
        return _ask(system, system.keys.mocked_world, message, MockedData)
    except _NotMockedError:
        if name is not None:
            raise
        return None


class _NotMockedError(SkillwingError):
    """A skill or world that is no mock. key: of the request, which ends with its name."""

    def __init__(self, key: str) -> None:
        self.key = key
        what = f"The {key.rpartition('/')[2]}" if key.endswith("/world") else f"`{key.rpartition('/')[2]}`"
        text = f"{what} does not answer as a mock: it is real, hangs, or has crashed. See `skillwing status`."
        super().__init__(text)


def _ask(system: System, key: str, message: Message, reply: type[M]) -> M:
    """Ask a mock. A script that it cannot use is an error of the user, not a refusal of the robot."""
    try:
        return system.ask(key, message, reply)
    except NoReplyError as error:
        raise _NotMockedError(key) from error
    except RefusedError as error:
        if error.code is ErrorCode.BAD_REQUEST:
            raise InvalidOptionError("words", str(error)) from error
        raise


# --- showing ---------------------------------------------------------------------------------------------------------


def _plain(plan: MockPlan) -> dict[str, Any]:
    return {"given": plan.given, "script": plan.script, "drawn": plan.drawn}


def _print(console: Console, plans: list[MockPlan], data: dict[str, Any]) -> None:
    if plans:
        print_table(console, ("SKILL", "NEXT GOAL", "THEN"), [(plan.skill, *plan_texts(plan)) for plan in plans])
    if plans and data:
        console.print()
    if data:
        print_table(console, ("DATUM", "NOW"), [(name, value_text(value)) for name, value in data.items()])
    if not plans and not data:
        console.print("Nothing is mocked here.")
