"""The checker's analysis against the resource manager: every report is right, and no problem is missed.

Random small skillsets are explored on the core of every robot (`playing.py`), and the findings of the analysis are
compared with the observations. They must be equal where the analysis is exact, and a subset where it approximates.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from random import Random

from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from playing import Playthrough, TooLargeError, about_resources, holds, play
from small_skillsets import Source, sources

from law_settings import examples
from skillwing.dsl.checking.analysis import report_on
from skillwing.dsl.checking.checker import check as check_text
from skillwing.dsl.checking.reachability.approximation import Approximation
from skillwing.dsl.checking.reachability.parts import PartByPart
from skillwing.dsl.checking.reachability.statespace import StateSpace
from skillwing.dsl.checking.resolver import resolve
from skillwing.dsl.diagnostics.diagnostic import Diagnostic, has_errors
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.model import Skill, Skillset
from skillwing.dsl.reading.parser import parse_file
from skillwing.services.protocol import NotReady, Violated

SMALL = settings(examples(30), suppress_health_check=list(HealthCheck))
EFFECT_CODES = {"SW040", "SW041", "SW042"}


def resolved(source: Source) -> Skillset:
    root = parse_file(str(source), "random").root
    assert root is not None
    report = DiagnosticReport()
    skillset = resolve(root, report)
    assert not has_errors(report.diagnostics)
    return skillset


def played(skillset: Skillset) -> Playthrough:
    try:
        return play(skillset)
    except TooLargeError:
        assume(False)
        raise


class Findings:
    """The reports of the analysis, by code and by the element on whose line they are."""

    def __init__(self, diagnostics: list[Diagnostic], source: Source) -> None:
        elements = {line: element for element, line in source.lines.items()}
        self.all = [(item.code, elements.get(item.span.line, ""), item.message) for item in diagnostics]
        self.errors = has_errors(diagnostics)

    def at(self, *codes: str) -> set[str]:
        return {element for code, element, _ in self.all if code in codes}


@SMALL
@given(sources())
def test_where_it_knows_exactly_it_neither_misses_nor_invents(source: Source) -> None:
    skillset = resolved(source)
    seen = played(skillset)
    space = StateSpace(skillset)
    report = DiagnosticReport()
    knowledge = PartByPart(space)
    assert knowledge.exact
    report_on(knowledge, space, report)
    findings = Findings(report.diagnostics, source)
    _nothing_is_invented(skillset, seen, findings)
    _nothing_is_missed(skillset, seen, findings)
    _warnings_are_right(skillset, seen, findings)


@SMALL
@given(sources())
def test_reasoning_resource_by_resource_never_invents_an_error(source: Source) -> None:
    skillset = resolved(source)
    seen = played(skillset)
    space = StateSpace(skillset)
    report = DiagnosticReport()
    report_on(Approximation(space), space, report)
    _nothing_is_invented(skillset, seen, Findings(report.diagnostics, source))


@SMALL
@given(sources(), st.randoms(use_true_random=False))
def test_what_is_reported_beside_damage_is_so_whatever_was_meant(source: Source, chance: Random) -> None:
    """The file as it was before one of its elements was damaged is one of those that may have been meant."""
    skillset = resolved(source)
    seen = played(skillset)
    line = chance.choice(list(source.lines.values())) - 1
    damaged = Source([*source.text], source.lines)
    damaged.text[line] = chance.choice(
        [re.sub(r"\b([ABC])\b", "NOWHERE", damaged.text[line]), f"{damaged.text[line]} $", damaged.text[line] + " }"]
    )
    found = check_text(str(damaged), "random").diagnostics
    assume(has_errors(found))
    _nothing_is_invented(skillset, seen, Findings(list(found), source))


# --- what is reported is so


def _nothing_is_invented(skillset: Skillset, seen: Playthrough, findings: Findings) -> None:
    for code, element, message in findings.all:
        owner, _, part = element.partition(".")
        match code:
            case "SW031" | "SW086":
                assert re.findall(r"to `?([ABC])\b", message)[0] not in seen.states[element], message
            case "SW050":
                assert not _ever_holds(skillset, seen, owner, part), message
            case "SW051":
                expression = skillset.skill(owner).invariant(part).expression
                assert not any(holds(expression, states) for states, _ in seen.rest), message
            case "SW052" | "SW061":
                assert (owner, part) not in seen.observed, message
            case "SW053":
                assert not _survives(seen, owner), message
            case "SW054":
                assert not seen.admitted[owner], message
            case "SW055":
                assert owner not in seen.fired, message
            case "SW042" if part:
                when = message.split(" when ")[1].partition(":")[0]
                assert (owner, when) not in seen.applied, message
            case "SW042":
                assert owner not in seen.fired, message
            case _:
                pass


def _ever_holds(skillset: Skillset, seen: Playthrough, skill: str, check: str) -> bool:
    """True if a precondition held at any time at which a start is evaluated."""
    expressions = {item.name: item.expression for item in skillset.skill(skill).preconditions.checks}
    idle = (states for states, running in seen.rest if skill not in running)
    return any(holds(expressions[check], states) for states in idle)


def _survives(seen: Playthrough, skill: str) -> bool:
    return any(skill in running for _, running in seen.rest)


# --- what is so is reported


def _nothing_is_missed(skillset: Skillset, seen: Playthrough, findings: Findings) -> None:
    for resource in skillset.resources:
        for state in set(resource.states) - seen.states[resource.name]:
            assert resource.name in findings.at("SW031", "SW082", "SW086") or findings.errors, (resource.name, state)
    for event in skillset.events:
        if event.name not in seen.fired:
            assert event.name in findings.at("SW041", "SW042", "SW044", "SW055"), event.name
    for skill in skillset.skills:
        _start_missed(skillset, skill, seen, findings)
        if _survives(seen, skill.name):
            _ends_missed(skill, seen, findings)


def _start_missed(skillset: Skillset, skill: Skill, seen: Playthrough, findings: Findings) -> None:
    name = skill.name
    for check in skill.preconditions.checks:
        if about_resources(check.expression) and not _ever_holds(skillset, seen, name, check.name):
            assert f"{name}.{check.name}" in findings.at("SW050"), check.name
    admitted = seen.admitted[name]
    wrong_checks = findings.at("SW050", "SW054")
    assert bool(admitted) is not any(element.startswith(f"{name}.") for element in wrong_checks), name
    started = [verdict for _, verdict in admitted if not isinstance(verdict, NotReady)]
    if admitted and not started:
        assert f"{name}.{skill.preconditions.success}" in findings.at(*EFFECT_CODES), name
    if started and all(isinstance(verdict, Violated) for verdict in started) and not _survives(seen, name):
        wrong = findings.at("SW051", "SW053")
        assert any(element.startswith(f"{name}.i") for element in wrong), name
    for when, effect in (("it is refused", skill.preconditions.failure), *_violations(skill)):
        if (name, when) in seen.judged - seen.applied:
            assert f"{name}.{effect}" in findings.at(*EFFECT_CODES), when


def _violations(skill: Skill) -> Iterator[tuple[str, str | None]]:
    return ((f"`{item.name}` is violated", item.violation) for item in skill.invariants)


def _ends_missed(skill: Skill, seen: Playthrough, findings: Findings) -> None:
    ends = [(f"it ends {result.name}", result.apply) for result in skill.results]
    ends += [("it is interrupted", skill.interrupt.apply), ("its manager is lost", skill.lost)]
    for when, effect in ends:
        if (skill.name, when) not in seen.applied:
            assert f"{skill.name}.{effect}" in findings.at(*EFFECT_CODES), when
    for result in skill.results:
        if (skill.name, result.name) not in seen.observed:
            wrong = findings.at("SW052", "SW061", *EFFECT_CODES)
            assert {f"{skill.name}.{result.name}", f"{skill.name}.{result.apply}"} & wrong, result.name


# --- warnings


def _warnings_are_right(skillset: Skillset, seen: Playthrough, findings: Findings) -> None:
    for skill in skillset.skills:
        name, start = skill.name, skill.preconditions.success
        verdicts = [verdict for _, verdict in seen.admitted[name]]
        startable = [states for states, verdict in seen.admitted[name] if not isinstance(verdict, NotReady)]
        blocked = bool(startable) and len(startable) < len(verdicts)
        assert blocked == (f"{name}.{start}" in findings.at("SW084")), name
        entered = [{**states, **dict(skill.transitions(start))} for states in startable]
        for invariant in skill.invariants:
            element = f"{name}.{invariant.name}"
            impossible = any(other.startswith(f"{name}.i") for other in findings.at("SW051", "SW053"))
            if about_resources(invariant.expression) and not impossible:
                broken = any(not holds(invariant.expression, states) for states in entered)
                assert broken == (element in findings.at("SW085")), element
        leaks = set(_leaks(skillset, skill, startable, seen))
        skill_is_sound = not any(
            element.partition(".")[0] == name and code < "SW080" for code, element, _ in findings.all
        )
        if skill_is_sound:
            warned = {
                message.split("`")[3] for code, element, message in findings.all if (code, element) == ("SW080", name)
            }
            assert leaks == warned, name


def _leaks(skillset: Skillset, skill: Skill, startable: list[dict[str, str]], seen: Playthrough) -> Iterator[str]:
    """The resources that the skill can leave taken forever although their own transitions lead back."""
    for resource, taken in skill.transitions(skill.preconditions.success):
        origins = {states[resource] for states in startable} - {taken}
        if not origins:
            continue
        hopeful = seen.hopeful(resource, origins)
        for (owner, label), nodes in seen.after.items():
            effects = {
                **{f"result `{result.name}`": result.apply for result in skill.results},
                **{f"violation of `{item.name}`": item.violation for item in skill.invariants},
                "interruption": skill.interrupt.apply,
                "loss of its manager": skill.lost,
            }
            if owner != skill.name:
                continue
            own = {taken, *(target for name, target in skill.transitions(effects[label]) if name == resource)}
            left = {dict(node[0])[resource] for node in nodes - hopeful} & own
            if any(_leads_back(skillset, resource, state, origins) for state in left):
                yield resource


def _leads_back(skillset: Skillset, resource: str, state: str, origins: set[str]) -> bool:
    reached = {state}
    for _ in skillset.resource(resource).states:
        reached |= {edge.target for edge in skillset.resource(resource).transitions if edge.source in reached}
    return bool(reached & origins)
