"""The diagrams of a skillset: its resources, its skills, and the map of both."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from skillwing.dsl.expressions import to_text
from skillwing.dsl.model import Resource, Result, Skill, Skillset
from skillwing.dsl.printing.pictures.diagram import Arrow, Diagram, DiagramNode
from skillwing.dsl.queries import changed_by, guarded_by

_START = "(start)"


def resource_diagram(resource: Resource) -> Diagram:
    """The state machine of a resource, as in Figures 3 and 4 of the paper. Extern transitions are dashed."""
    states = (DiagramNode(state, state, "state") for state in resource.states)
    edges = (Arrow(edge.source, edge.target, dashed=edge.extern) for edge in resource.transitions)
    return Diagram(
        title=f"resource {resource.name}",
        nodes=(DiagramNode(_START, "", "start"), *states),
        arrows=(Arrow(_START, resource.initial), *edges),
        legend="dashed: extern, by the functional layer" if any(edge.extern for edge in resource.transitions) else "",
        gaps=(65.0, 43.0),
    )


def map_diagram(skillset: Skillset) -> Diagram:
    """All skills and resources. A solid arrow changes the resource, a dashed one only reads its state."""
    arrows = tuple(arrow for skill in skillset.skills for arrow in _uses(skill, skillset.resources))
    skills = (DiagramNode(f"skill {skill.name}", skill.name, "skill") for skill in skillset.skills)
    resources = (DiagramNode(f"resource {resource.name}", resource.name, "resource") for resource in skillset.resources)
    return Diagram(
        title=f"skillset {skillset.name}",
        nodes=(*skills, *resources),
        arrows=arrows,
        legend="solid: the skill changes the resource; dashed: it only asks for its state",
        gaps=(195.0, 25.0),
    )


def _uses(skill: Skill, resources: Iterable[Resource]) -> Iterator[Arrow]:
    changed, asked = changed_by(skill), guarded_by(skill)
    for resource in resources:
        if resource.name in changed | asked:
            dashed = resource.name not in changed
            yield Arrow(f"skill {skill.name}", f"resource {resource.name}", dashed=dashed)


# --- the machine of a skill


def skill_diagram(skill: Skill) -> Diagram:
    """The state machine of Figure 5 of the paper with the names of this skill. `/ e` is the applied effect.

    Ends of a running goal also end it while it is being interrupted; those arrows are left out.
    """
    states = (DiagramNode(state, state, "state") for state in ("VALIDATING", "DISPATCHING", "RUNNING", "INTERRUPTING"))
    endings = list(_endings(skill))
    return Diagram(
        title=f"skill {skill.name}",
        nodes=(DiagramNode(_START, "", "start"), *states, *(node for node, _ in endings)),
        arrows=(
            Arrow(_START, "VALIDATING", (f"start({', '.join(field.name for field in skill.inputs)})",)),
            Arrow("VALIDATING", "DISPATCHING", _granted(skill)),
            Arrow("DISPATCHING", "RUNNING", ("on_dispatch returns",)),
            Arrow("RUNNING", "INTERRUPTING", _interrupted(skill)),
            *(arrow for _, arrow in endings),
        ),
    )


def _applies(what: str, effect: str | None) -> str:
    return what if effect is None else f"{what} / {effect}"


def _granted(skill: Skill) -> tuple[str, ...]:
    *checks, last = [check.name for check in skill.preconditions.checks] or ["accepted"]
    return (*checks, _applies(last, skill.preconditions.success))


def _interrupted(skill: Skill) -> tuple[str, ...]:
    deadline = () if skill.deadline is None else (f"or {skill.deadline:g} s are over",)
    return ("interrupt", *deadline)


def _endings(skill: Skill) -> Iterator[tuple[DiagramNode, Arrow]]:
    """Every terminal state with its incoming arrow."""

    def ending(name: str, source: str, *lines: str) -> tuple[DiagramNode, Arrow]:
        return DiagramNode(name, name, "ending"), Arrow(source, name, lines)

    refused = skill.preconditions
    yield ending("NV", "VALIDATING", "out of range, or", "validate refuses")
    if refused.checks or skill.transitions(refused.success):
        reason = "not all hold" if refused.checks else "not possible"
        yield ending("NR", "VALIDATING", _applies(reason, refused.failure))
    for result in skill.results:
        name = f"S_{result.name}"
        yield (
            DiagramNode(name, name, "success" if result.success else "failure"),
            Arrow("RUNNING", name, _terminated(result)),
        )
    if any(result.post is not None or skill.transitions(result.apply) for result in skill.results):
        yield ending("N_...", "RUNNING", "a result whose effect", "or post does not hold")
    if skill.invariants:
        violations = [_applies(f"not {invariant.name}", invariant.violation) for invariant in skill.invariants]
        yield ending("RI", "RUNNING", *violations)
    yield ending("ERROR", "RUNNING", _applies("a hook raises", skill.lost))
    yield ending("LOST", "RUNNING", _applies("the manager is gone", skill.lost))
    stopped = _applies(f"or {skill.interrupt.timeout:g} s later", skill.interrupt.apply)
    yield ending("IT", "INTERRUPTING", "stopped,", stopped)


def _terminated(result: Result) -> tuple[str, ...]:
    post = () if result.post is None else (f"post {to_text(result.post)}",)
    return (_applies(result.name, result.apply), *post)
