"""`interface.py` and `aio.py`: typed clients, blocking and for asyncio, from one template.

`signatures.py` holds the parts that both share.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from skillwing.dsl.generating.source_text import (
    INDENT,
    LINE_LENGTH,
    TypeNames,
    annotation,
    answer_classes,
    default,
    docstring,
    method,
    remark,
)
from skillwing.dsl.model import DataItem, Field, Skill, Skillset
from skillwing.dsl.naming import class_name

_OPTIONS = ("goal_id", "cause")
_OWN = ("Skills", "Resources", "Data", "Events")
_CONNECT = '''\


@{decorator}
{asynchronous}def connect(
    robot: str | None = None,
    *,
    endpoint: str | None = None,
    owns_goals: bool = True,
) -> _{generator}[{robot}{sends}]:
    """Connect to a running `{skillset}`.

    robot: its name, optional if only one runs here. endpoint: `tcp/HOST:PORT` of its router, if it runs elsewhere.
    owns_goals: goals that still run at the end of the context, or of the script, are interrupted, unless their skill
    says `owner_lost=continue`; with False they continue.
    Raises NoSystemError, NoReplyError, and a SkillwingError if the system runs another skillset than this code was
    generated from.
    """
    {asynchronous}with {runtime}.connect(
        robot, endpoint=endpoint, owns_goals=owns_goals, table=_processes.TABLE, schema=_SCHEMA_HASH
    ) as client:
        yield {robot}(client)'''


@dataclass(frozen=True)
class ClientStyle:
    """One of the two client styles: name of its module, imports, and the words in which it differs.

    library: the module of `skillwing.services.client` that it uses; the generated module imports it as `_library`.
    """

    module: str
    summary: str
    library: str
    generator: str
    sends: str
    decorator: str
    asynchronous: str
    awaited: str
    goal: str

    @property
    def runtime(self) -> str:
        """The name of the library in the module."""
        return f"_{self.library}"


WAITING = ClientStyle(
    "interface.py",
    "for blocking scripts",
    "sync",
    "Generator",
    ", None, None",
    "contextmanager",
    "",
    "",
    "methods return a goal at once; its `wait` returns the outcome",
)
ASYNCHRONOUS = ClientStyle(
    "aio.py",
    "for asyncio",
    "aio",
    "AsyncGenerator",
    ", None",
    "asynccontextmanager",
    "async ",
    "await ",
    "methods return a goal at once; awaiting it returns the outcome",
)


def signatures(skillset: Skillset) -> Iterator[str]:
    """The lines of `signatures.py`."""
    names = TypeNames(skill.name for skill in skillset.skills)
    body = [line for skill in skillset.skills for line in _signature(skill, names)]
    yield f'"""Signatures of the skills of `{skillset.name}`: results, outputs and feedback."""'
    yield ""
    yield "from __future__ import annotations"
    if body:
        yield from ("", "from skillwing.services.client.outcome import Signature as _Signature", "")
        yield from names.module_import()
        yield from names.imports()
        yield ""
        yield from body


def _signature(skill: Skill, names: TypeNames) -> Iterator[str]:
    outputs, feedback = answer_classes(skill, names)
    kind = f"_Signature[{names(class_name(skill.name) + 'Result')}, {outputs}, {feedback}]"
    one_line = f'{skill.name} = {kind}("{skill.name}", {outputs}, {feedback})'
    if len(one_line) <= LINE_LENGTH:
        yield one_line
    else:
        yield from (f"{skill.name} = {kind}(", f'{INDENT}"{skill.name}", {outputs}, {feedback}', ")")


READY = "ready"
"""Name of the method that asks whether a skill may start."""


def lines(skillset: Skillset, style: ClientStyle) -> Iterator[str]:
    """The lines of the client's module."""
    robot = class_name(skillset.name)
    # The methods that start skills hide types in the rest of their class.
    hidden = {skill.name for skill in skillset.skills}
    modifiable = [skill for skill in skillset.skills if skill.modifiable]
    goals = {_goal_class(skill) for skill in modifiable}
    names = TypeNames({robot, *(robot + suffix for suffix in _OWN), *hidden, *goals})
    views = [
        ("resources", "Resources", skillset.resources, _resources),
        ("data", "Data", skillset.data, _data),
        ("events", "Events", skillset.events, _events),
    ]
    present = [(view, suffix, write) for view, suffix, declared, write in views if declared]
    body = [line for skill in modifiable for line in _goal(skill, names, style)]
    body += _skills(skillset, names, style)
    for _, suffix, write in present:
        body += ["", "", f"class {robot}{suffix}:", *write(skillset, names, style)]
    # A skill called like a view hides it: `M600Data(client)` still makes one.
    shown = [(view, suffix) for view, suffix, _ in present if view not in hidden]
    body += _robot(robot, style, shown, asks=READY not in hidden)
    connect = _CONNECT.format(skillset=skillset.name, robot=robot, runtime=style.runtime, **vars(style))
    body += connect.splitlines()
    yield f'"""Typed access to `{skillset.name}`, {style.summary}: {style.goal}.'
    yield ""
    yield f"{style.asynchronous}with connect() as {skillset.name}:"
    yield f"{INDENT}outcome = {_example(skillset, style)}"
    yield '"""'
    yield ""
    yield "from __future__ import annotations"
    yield ""
    yield f"from collections.abc import {style.generator} as _{style.generator}"
    yield f"from contextlib import {style.decorator}"
    yield ""
    yield f"from skillwing.services.client import {style.library} as {style.runtime}"
    yield ""
    yield "from . import SCHEMA_HASH as _SCHEMA_HASH"
    yield "from . import processes as _processes"
    if skillset.skills:
        yield "from . import signatures as _signatures"
    yield from names.module_import()
    yield from names.imports()
    yield from body


def _example(skillset: Skillset, style: ClientStyle) -> str:
    """An example call for the docstring."""
    skill = skillset.skills[0].name if skillset.skills else "skill"
    started = f"{skillset.name}.{skill}(...)"
    return f"await {started}" if style.awaited else f"{started}.wait()"


# --- skills


def _goal_class(skill: Skill) -> str:
    """The class of the goals of a skill with modifiable inputs."""
    return f"{class_name(skill.name)}Goal"


def _goal_base(skill: Skill, names: TypeNames, style: ClientStyle) -> str:
    outputs, feedback = answer_classes(skill, names)
    return f"{style.runtime}.Goal[{names(class_name(skill.name) + 'Result')}, {outputs}, {feedback}]"


def _goal(skill: Skill, names: TypeNames, style: ClientStyle) -> Iterator[str]:
    """The class of goals that can be modified."""
    yield from ("", "", f"class {_goal_class(skill)}({_goal_base(skill, names, style)}):")
    yield f'{INDENT}"""A goal of `{skill.name}`. Its inputs can be modified while it runs."""'
    yield ""
    fields = [f"{field.name}: {annotation(field.type, names)} | None = None" for field in skill.modifiable]
    yield from method(f"{style.asynchronous}def modify", fields, "None")
    summary = "Give the running goal new inputs; one of None stays. All are taken, or none."
    yield from docstring(summary, "Raises RefusedError, also if the goal has ended, and NoReplyError.")
    passed = [f'"{field.name}": {field.name}' for field in skill.modifiable]
    one_line = f"{INDENT * 2}{style.awaited}self.modify_inputs({{{', '.join(passed)}}})"
    if len(one_line) <= LINE_LENGTH:
        yield one_line
    else:
        yield f"{INDENT * 2}{style.awaited}self.modify_inputs("
        yield from (f"{INDENT * 3}{{", *(f"{INDENT * 4}{pair}," for pair in passed), f"{INDENT * 3}}}")
        yield f"{INDENT * 2})"


def _skills(skillset: Skillset, names: TypeNames, style: ClientStyle) -> Iterator[str]:
    yield from ("", "", f"class {class_name(skillset.name)}Skills:")
    yield f'{INDENT}"""Starts skills.'
    yield ""
    yield f"{INDENT}goal_id: the client chooses one unless given. cause: the timeline record that leads here."
    yield f"{INDENT}Raises InvalidInputError for a value of a wrong type."
    yield f'{INDENT}"""'
    yield ""
    yield f"{INDENT}def __init__(self, client: {style.runtime}.Client) -> None:"
    yield f"{INDENT * 2}self._client = client"
    for skill in skillset.skills:
        yield ""
        yield from _starter(skill, names, style)


def _starter(skill: Skill, names: TypeNames, style: ClientStyle) -> Iterator[str]:
    taken = {field.name for field in skill.inputs}
    options = [option for option in _OPTIONS if option not in taken]
    parameters = [
        *(f"{field.name}: {annotation(field.type, names)}{default(field, names)}" for field in skill.inputs),
        *(f"{option}: str | None = None" for option in options),
    ]
    goal = _goal_class(skill) if skill.modifiable else _goal_base(skill, names, style)
    yield from method(f"def {skill.name}", parameters, goal)
    yield from _starter_docstring(skill)
    inputs = [f'"{field.name}": {field.name}' for field in skill.inputs]
    passed = "".join(f", {option}={option}" for option in options)
    start = f"start_as({goal}, " if skill.modifiable else "start("
    one_line = f"{INDENT * 2}return self._client.{start}_signatures.{skill.name}, {{{', '.join(inputs)}}}{passed})"
    if len(one_line) <= LINE_LENGTH:
        yield one_line
        return
    yield f"{INDENT * 2}return self._client.{start.partition('(')[0]}("
    if skill.modifiable:
        yield f"{INDENT * 3}{goal},"
    yield f"{INDENT * 3}_signatures.{skill.name},"
    in_one = f"{INDENT * 3}{{{', '.join(inputs)}}},"
    if len(in_one) <= LINE_LENGTH:
        yield in_one
    else:
        yield from (f"{INDENT * 3}{{", *(f"{INDENT * 4}{pair}," for pair in inputs), f"{INDENT * 3}}},")
    yield from (f"{INDENT * 3}{option}={option}," for option in options)
    yield f"{INDENT * 2})"


def _starter_docstring(skill: Skill) -> Iterator[str]:
    remarks = [f"{field.name}: {told}" for field in skill.inputs if (told := remark(field))]
    summary = f'{INDENT * 2}"""Start `{skill.name}`.'
    if not remarks:
        yield f'{summary}"""'
    elif len(one_line := f'{summary} {"; ".join(remarks)}."""') <= LINE_LENGTH:
        yield one_line
    else:
        yield from (summary, "", *(f"{INDENT * 2}{told}." for told in remarks), f'{INDENT * 2}"""')


# --- views


def _resources(skillset: Skillset, names: TypeNames, style: ClientStyle) -> Iterator[str]:
    yield f'{INDENT}"""The resources of `{skillset.name}`."""'
    yield ""
    yield f"{INDENT}def __init__(self, client: {style.runtime}.Client) -> None:"
    for resource in skillset.resources:
        states = names(f"{class_name(resource.name)}State")
        yield f'{INDENT * 2}self.{resource.name} = {style.runtime}.Resource[{states}](client, "{resource.name}")'


def _data(skillset: Skillset, names: TypeNames, style: ClientStyle) -> Iterator[str]:
    yield f'{INDENT}"""The data of `{skillset.name}`."""'
    yield ""
    yield f"{INDENT}def __init__(self, client: {style.runtime}.Client) -> None:"
    for item in skillset.data:
        kind = annotation(item.type, names)
        yield f'{INDENT * 2}self.{item.name} = {style.runtime}.Datum[{kind}](client, "{item.name}", {kind})'
        if told := _data_remark(item):
            yield f'{INDENT * 2}"""{told}"""'


def _data_remark(item: DataItem) -> str:
    told = remark(Field(item.name, item.type, item.unit, item.low, item.high))
    return f"{told} every {item.period} s".strip() if item.period is not None else told


def _events(skillset: Skillset, names: TypeNames, style: ClientStyle) -> Iterator[str]:
    del names
    yield f'{INDENT}"""Fires the events of `{skillset.name}` in place of the functional layer.'
    yield ""
    yield f"{INDENT}Raises RefusedError if a guard forbids it, and NoReplyError."
    yield f'{INDENT}"""'
    yield ""
    yield f"{INDENT}def __init__(self, client: {style.runtime}.Client) -> None:"
    yield f"{INDENT * 2}self._client = client"
    for event in skillset.events:
        yield ""
        yield f"{INDENT}{style.asynchronous}def {event.name}(self) -> None:"
        yield f'{INDENT * 2}{style.awaited}self._client.fire("{event.name}")'


# --- the robot


def _robot(robot: str, style: ClientStyle, views: list[tuple[str, str]], *, asks: bool) -> Iterator[str]:
    """The class of the robot. asks: it has `ready`, which no skill hides."""
    yield from ("", "", f"class {robot}({robot}Skills):")
    yield f'{INDENT}"""The robot: its skills, resources, data and events."""'
    yield ""
    yield f"{INDENT}def __init__(self, client: {style.runtime}.Client) -> None:"
    yield f"{INDENT * 2}super().__init__(client)"
    yield from (f"{INDENT * 2}self.{view} = {robot}{suffix}(client)" for view, suffix in views)
    if asks:
        yield f"{INDENT * 2}self.{READY} = client.{READY}"
