"""Who takes a transition. An `.rl` file does not say; it follows from what its skills and events do."""

from __future__ import annotations

from collections.abc import Iterator, Set
from dataclasses import replace

from skillwing.dsl.reading.syntax import CoinedWord, InitialSyntax, ResourceSyntax, StatesSyntax, TransitionSyntax

EVERY_STATE = "*"


def divided(
    resource: ResourceSyntax, by_skills: Set[tuple[str, str]], by_events: Set[tuple[str, str]]
) -> ResourceSyntax:
    """Mark the transitions of a resource as internal, extern or both. by_...: (resource, target state) pairs.

    What a skill brings about is internal, what an event does is extern. What nobody in the file brings about is
    extern, too: published files leave it to the robot, a pilot handing over authority for instance.
    """
    name = resource.name.text
    items: list[StatesSyntax | InitialSyntax | TransitionSyntax] = []
    for item in resource.items:
        if not isinstance(item, TransitionSyntax):
            items.append(item)
            continue
        for edge in _by_target(item, resource):
            change = (name, edge.target.text)
            if change in by_skills:
                items.append(edge)
            if change in by_events or change not in by_skills:
                items.append(replace(edge, extern=True))
    return ResourceSyntax(resource.name, tuple(items))


def _by_target(edge: TransitionSyntax, resource: ResourceSyntax) -> Iterator[TransitionSyntax]:
    """A transition into any state as one transition for each state, since they may differ in who takes them."""
    if edge.target.text != EVERY_STATE:
        yield edge
        return
    for states in (item for item in resource.items if isinstance(item, StatesSyntax)):
        for state in states.names:
            yield replace(edge, target=CoinedWord(state.text, edge.target.span))
