"""Requests for changes of resources: extern transitions and events."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.dsl.model import Skillset, UnknownNameError
from skillwing.services.bus import Answer, Answered, Bus
from skillwing.services.client.causal_feed import CausalFeed
from skillwing.services.protocol import FireEvent, FireExtern, Keys, encode


class ResourceChanges:
    """Requests of one client. The states after a change are known in its feed before the reply is handed on.

    source: name of the client, for the timeline. An answer to a change is `ResourceStates` or a refusal.
    """

    def __init__(self, bus: Bus, skillset: Skillset, feed: CausalFeed, *, source: str) -> None:
        self._bus = bus
        self._skillset = skillset
        self._keys = Keys(skillset.name)
        self._feed = feed
        self._source = source

    def trigger(
        self, resource: str, target: str, on_answer: Callable[[Answer], None], cause: str | None = None
    ) -> None:
        """Drive an extern transition. Raises UnknownNameError for a resource or state that does not exist."""
        model = self._skillset.resource(resource)
        if target not in model.states:
            raise UnknownNameError(f"state of {resource}", target, model.states)
        schema = self._skillset.schema_hash
        request = FireExtern(resource=resource, target=target, source=self._source, cause=cause, schema=schema)
        self._ask(self._keys.resource_extern, request, on_answer)

    def fire(self, event: str, on_answer: Callable[[Answer], None], cause: str | None = None) -> None:
        """Fire an event. Raises UnknownNameError."""
        name, schema = self._skillset.event(event).name, self._skillset.schema_hash
        request = FireEvent(event=name, source=self._source, cause=cause, schema=schema)
        self._ask(self._keys.event(event), request, on_answer)

    def _ask(self, key: str, request: FireExtern | FireEvent, on_answer: Callable[[Answer], None]) -> None:
        question = self._feed.note_question()

        def receive(answer: Answer) -> None:
            if isinstance(answer, Answered):
                self._feed.take_change(answer.payload, question, lambda: on_answer(answer))
            else:
                on_answer(answer)

        self._bus.ask(key, encode(request), receive)
