"""The test of one skill: its manager, with fakes for everything around it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, cast

import msgspec

from skillwing.dsl.model import Skillset
from skillwing.services.bus import Node
from skillwing.services.managers.hooks import F, I, O, SkillHooks
from skillwing.services.names import skill_process
from skillwing.services.testing.fake_layer import FakeLayer
from skillwing.services.testing.goal import GoalUnderTest
from skillwing.services.testing.in_process import HooksFactory, SkillsetInProcess


class SkillTest(SkillsetInProcess, Generic[I, O, F]):
    """One skill's manager in virtual time: set the context, start, advance time, check the answer.

    hooks: the class under test, or a callable that makes its hooks. others: the same of skills that run beside it; no
    other skill has a manager. All other arguments are those of `SkillsetInProcess`.
    """

    def __init__(
        self,
        skillset: Skillset | str | Path,
        hooks: Callable[[], SkillHooks[I, O, F]],
        others: Iterable[HooksFactory] = (),
        *,
        states: Mapping[str, str] | None = None,
        data: Mapping[str, object] | None = None,
        layer: FakeLayer | None = None,
        nodes: Sequence[Node] = (),
    ) -> None:
        super().__init__(skillset, (hooks, *others), mocks=False, states=states, data=data, layer=layer, nodes=nodes)
        self.skill = next(iter(self.hooks))

    def start(self, inputs: I | Mapping[str, Any] | None = None, /, **fields: Any) -> GoalUnderTest[O, F]:
        """Start the skill, and return when its goal runs or has ended. See `start_skill`."""
        given = cast("Mapping[str, Any] | msgspec.Struct | None", inputs)
        return self.start_skill(self.skill, given, **fields)

    def send(self, inputs: I | Mapping[str, Any] | None = None, /, **fields: Any) -> GoalUnderTest[O, F]:
        """Send the start of the skill and return at once, before its manager receives it."""
        given = cast("Mapping[str, Any] | msgspec.Struct | None", inputs)
        return self.send_start(self.skill, given, **fields)

    def kill(self, process: str | None = None) -> None:
        """Kill a node at once; without a name, the skill's manager."""
        super().kill(process or skill_process(self.skill))

    def restart(self, process: str | None = None) -> None:
        """Restart a killed manager; without a name, the skill's."""
        super().restart(process or skill_process(self.skill))
