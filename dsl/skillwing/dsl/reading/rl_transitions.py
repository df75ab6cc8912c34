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

    What events bring about is extern. So is the whole of a resource that neither event nor skill changes: only the
    functional layer can be meant to. Everything else is internal.
    """
    name = resource.name.text
    left_alone = all(changed != name for changed, _ in by_skills | by_events)
    items: list[StatesSyntax | InitialSyntax | TransitionSyntax] = []
    for item in resource.items:
        if not isinstance(item, TransitionSyntax):
            items.append(item)
            continue
        for edge in _by_target(item, resource):
            change = (name, edge.target.text)
            extern = left_alone or change in by_events
            if change in by_skills or not extern:
                items.append(edge)
            if extern:
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
