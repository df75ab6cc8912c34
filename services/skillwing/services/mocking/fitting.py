"""Check of a mock script against a skillset, and its meaning there. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import msgspec

from skillwing.dsl.model import Field, Resource, ScalarType, Skill, Skillset, UnknownNameError
from skillwing.services.mocking.script import (
    LONGEST,
    Choices,
    InputDelay,
    MockRun,
    MockScript,
    Reaction,
    ScriptError,
    When,
)
from skillwing.services.mocking.signals import Fields, FromInput, Signal, SignalReader
from skillwing.services.protocol import Ending

How: TypeAlias = Literal["result", "forever", "invalid", "error", "hang", "crash"]
Report = Callable[[str], None]
HOWS: tuple[How, ...] = ("result", "forever", "invalid", "error", "hang", "crash")


@dataclass(frozen=True, slots=True)
class FittedRun:
    """A run of one skill, complete except for its drawn delay.

    text: the result's name, or the sentence of `invalid` and `error`. delay: bounds in seconds, or an input.
    stop_delay: None for never. said: the run as written by its author.
    """

    how: How
    text: str
    delay: tuple[float, float] | FromInput
    output: Fields
    progress: Fields
    stop_delay: float | None
    weight: float
    said: MockRun


@dataclass(frozen=True, slots=True)
class FittedRuns:
    """The runs of one skill, in sequence or drawn by weight."""

    runs: tuple[FittedRun, ...]
    drawn: bool = False


@dataclass(frozen=True, slots=True)
class FittedReaction:
    """A reaction whose names all exist. set: signals by datum."""

    said: Reaction
    endings: frozenset[str]
    set: Mapping[str, Signal]
    fire: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FittedScript:
    """A script fitted to a skillset: runs for every skill, signals for the data in it."""

    skills: Mapping[str, FittedRuns]
    seed: int
    data: Mapping[str, Signal]
    resources: Mapping[str, str]
    reactions: tuple[FittedReaction, ...]


def fit_script(script: MockScript, skillset: Skillset) -> FittedScript:
    """Fit a script to a skillset. Raises ScriptError with all problems."""
    problems: list[str] = []
    fitted = _fit(script, skillset, problems.append)
    if problems:
        raise ScriptError("The mock script", problems)
    return fitted


def problems_of(script: MockScript, skillset: Skillset) -> list[str]:
    """A sentence for each problem of a script with a skillset."""
    problems: list[str] = []
    _fit(script, skillset, problems.append)
    return problems


def fit_run(run: MockRun, skill: Skill, report: Report, where: str = "The run") -> FittedRun:
    """Fit one run to its skill. Problems are reported, and the run is not usable then."""
    given: dict[How, Any] = {how: getattr(run, how) for how in HOWS if getattr(run, how) not in (None, False)}
    if len(given) > 1:
        report(f"{where} says {' and '.join(f'`{how}`' for how in given)}. Say one of them.")
    how, text = next(iter(given.items()), (None, None))
    if how is None:
        result = next((each.name for each in skill.results if each.success), None)
        how, text = ("forever", None) if result is None else ("result", result)
    if how == "result":
        _look_up(lambda: skill.result(str(text)), where, report)
    if run.output and how != "result":
        report(f"{where} has an `output`, and no result that it could go with. Leave out one of the two.")
    reader = SignalReader(report, skill.inputs)
    return FittedRun(
        how=how,
        text=text if isinstance(text, str) else "",
        delay=_fit_delay(run.delay, reader, f"{where}.delay"),
        output=reader.read_fields(run.output, skill.outputs, f"{where}.output"),
        progress=reader.read_fields(run.progress, skill.feedback, f"{where}.progress"),
        stop_delay=None if run.stop_delay == "never" else run.stop_delay,
        weight=run.weight,
        said=msgspec.structs.replace(run, result=str(text)) if how == "result" else run,
    )


def _fit_delay(
    delay: float | tuple[float, float] | InputDelay, reader: SignalReader, where: str
) -> tuple[float, float] | FromInput:
    if isinstance(delay, InputDelay):
        return reader.from_input(delay.input, Field("delay", ScalarType("float64")), where) or FromInput(())
    low, high = delay if isinstance(delay, tuple) else (delay, delay)
    if not 0.0 <= low <= high <= LONGEST:
        reader.report(f'{where} is {delay}; it takes seconds from 0 on, [lowest, highest], or {{input = "NAME"}}.')
    return low, high


def fit_datum(
    raw: Any, datum: str, skillset: Skillset, report: Report, inputs: tuple[Field, ...] | None = None
) -> Signal | None:
    """The signal of a datum; None if a problem was reported. inputs: of the goal that sets it, if any."""
    item = _look_up(lambda: skillset.datum(datum), f"data.{datum}", report)
    if item is None:
        return None
    return SignalReader(report, inputs, has_duration=False).read(raw, Field(item.name, item.type), f"data.{datum}")


def _fit(script: MockScript, skillset: Skillset, report: Report) -> FittedScript:
    skills = {skill.name: FittedRuns((fit_run(MockRun(), skill, report),)) for skill in skillset.skills}
    for name, runs in script.skills.items():
        skill = _look_up(lambda name=name: skillset.skill(name), f"skill.{name}", report)
        if skill is None or not runs:
            continue
        drawn = isinstance(runs, Choices)
        form = "choices" if drawn else "runs"
        fitted = tuple(
            fit_run(run, skill, report, f"skill.{name}" if len(runs) == 1 else f"skill.{name}.{form}[{number}]")
            for number, run in enumerate(runs)
        )
        skills[name] = FittedRuns(fitted, drawn)
    signals = {name: fit_datum(raw, name, skillset, report) for name, raw in script.data.items()}
    for name, state in script.resources.items():
        _check_trigger(skillset, name, state, "resources", report, from_initial=True)
    return FittedScript(
        skills=skills,
        seed=script.seed or 0,
        data={name: signal for name, signal in signals.items() if signal is not None},
        resources=script.resources,
        reactions=tuple(
            _fit_reaction(reaction, skillset, f"reaction[{number}]", report)
            for number, reaction in enumerate(script.reactions)
        ),
    )


# --- reactions -------------------------------------------------------------------------------------------------------


def _fit_reaction(reaction: Reaction, skillset: Skillset, where: str, report: Report) -> FittedReaction:
    inputs, endings = _fit_when(reaction.when, skillset, f"{where}.when", report)
    fire = (reaction.fire,) if isinstance(reaction.fire, str) else reaction.fire
    for resource, state in reaction.trigger.items():
        _check_trigger(skillset, resource, state, f"{where}.trigger", report)
    for event in fire:
        _look_up(lambda event=event: skillset.event(event), f"{where}.fire", report)
    for name, result in reaction.end.items():
        skill = _look_up(lambda name=name: skillset.skill(name), f"{where}.end", report)
        if skill is not None:
            _look_up(lambda skill=skill, result=result: skill.result(result), f"{where}.end.{name}", report)
    if not (reaction.trigger or fire or reaction.set or reaction.end):
        report(f"{where} does nothing. Give it `trigger`, `fire`, `set` or `end`.")
    signals = {
        name: fit_datum(raw, name, skillset, lambda text: report(f"{where}.set: {text}"), inputs)
        for name, raw in reaction.set.items()
    }
    return FittedReaction(
        said=reaction,
        endings=endings,
        set={name: signal for name, signal in signals.items() if signal is not None},
        fire=fire,
    )


def _fit_when(
    when: When | None, skillset: Skillset, where: str, report: Report
) -> tuple[tuple[Field, ...] | None, frozenset[str]]:
    """The inputs of the goal that a reaction belongs to, if any, and the endings that it waits for."""
    if when is None:
        return None, frozenset()
    endings = frozenset((when.ending,) if isinstance(when.ending, str) else when.ending)
    subjects = [name for name in ("resource", "starts", "ends") if getattr(when, name) is not None]
    if len(subjects) != 1:
        report(f"{where} takes one of `resource` (with `becomes`), `starts` and `ends`.")
        return None, endings
    if (when.resource is None) != (when.becomes is None):
        report(f"{where} takes `resource` and `becomes` together.")
    elif when.resource is not None and when.becomes is not None:
        _check_state(skillset, when.resource, when.becomes, where, report)
    if endings and when.ends is None:
        report(f"{where} takes `with` only together with `ends`.")
    name = when.starts or when.ends
    if name is None:
        return None, endings
    skill = _look_up(lambda: skillset.skill(name), where, report)
    if skill is None:
        return None, endings
    results = {result.name for result in skill.results}
    labels = {*map(str, Ending), *(f"{ending}_{each}" for each in results for ending in "SN"), *results}
    for ending in sorted(endings - labels):
        problem = UnknownNameError(f"end of {skill.name}", ending, (*sorted(results), *map(str, Ending)))
        report(f"{where}: {problem}")
    return skill.inputs, endings


def _check_state(skillset: Skillset, name: str, state: str, where: str, report: Report) -> Resource | None:
    """The resource, if it and its state exist."""
    resource = _look_up(lambda: skillset.resource(name), where, report)
    if resource is not None and state not in resource.states:
        report(f"{where}: {UnknownNameError(f'state of {name}', state, resource.states)}")
        return None
    return resource


def _check_trigger(
    skillset: Skillset, name: str, state: str, where: str, report: Report, *, from_initial: bool = False
) -> None:
    """True if the functional layer may bring a resource to a state, from its initial one or at least from some."""
    resource = _check_state(skillset, name, state, where, report)
    if resource is None:
        return
    sources: Iterable[str] = (resource.initial,) if from_initial else resource.states
    if not any(resource.allows(source, state, extern=True) for source in sources if from_initial or source != state):
        start = f" from {resource.initial}" if from_initial else ""
        report(f"{where}: no extern transition brings {name}{start} to {state}. Choose another state.")


def _look_up(find: Callable[[], Any], where: str, report: Report) -> Any:
    """The result of `find`; None, with a report, for an unknown name."""
    try:
        return find()
    except UnknownNameError as error:
        report(f"{where}: {error}")
        return None
