"""All managers of a skillset in one process and in virtual time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import count
from pathlib import Path
from typing import Any, TypeAlias

from skillwing.dsl.model import Skillset, UnknownNameError
from skillwing.services.bus import Bus, Node
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.managers.data_manager import DataManagerNode
from skillwing.services.managers.hooks import SkillHooks
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.managers.skill_manager import SkillManagerNode
from skillwing.services.mocking import MockScript, make_mock_skill
from skillwing.services.names import DATA_MANAGER, RESOURCE_MANAGER, skill_process
from skillwing.services.testing.bench import CLIENT, Bench
from skillwing.services.testing.context import checked_states, model_of
from skillwing.services.testing.fake_layer import FakeLayer

HooksFactory: TypeAlias = Callable[[], SkillHooks[Any, Any, Any]]
"""A class derived from SkillHooks, or a callable that makes such hooks: `lambda: DriveManager(fake_motor)`."""


class SkillsetInProcess(Bench):
    """A whole skillset: real managers with the given hooks, mocks for all other skills.

    skillset: the model, or the path of its file. hooks: classes or functions that make them, of any skills. mocks:
    False leaves the other skills without a manager; script: of the mocks (docs/mocks.md). states: initial states of
    resources, set directly, also those that only skills may change. data: values that are published from the start,
    each at its declared period. layer: the fake functional layer. nodes: further nodes of the robot. seed, jitter: of
    the transport delay; with the same values a run repeats exactly.

    Raises SkillsetError for a file with errors, ContextError for a context that does not fit the model, TypeError for
    instances of hooks.
    """

    def __init__(
        self,
        skillset: Skillset | str | Path,
        hooks: Iterable[HooksFactory] = (),
        *,
        mocks: bool = True,
        script: MockScript | None = None,
        states: Mapping[str, str] | None = None,
        data: Mapping[str, object] | None = None,
        layer: FakeLayer | None = None,
        nodes: Sequence[Node] = (),
        seed: int = 0,
        jitter: float = 0.0,
    ) -> None:
        model = model_of(skillset)
        layer = layer or FakeLayer()
        found = checked_states(model, states or {})
        journal = Journal(None, Identity("", model.name, model.schema_hash))
        self.network = InProcessNetwork(seed=seed, jitter=jitter)
        self.hooks: dict[str, SkillHooks[Any, Any, Any]] = {}
        """Hooks of the managers, by skill."""
        self._running: dict[str, tuple[Node, Bus]] = {}
        self._makers: dict[str, Callable[[], Node]] = {
            DATA_MANAGER: lambda: DataManagerNode(model),
            RESOURCE_MANAGER: lambda: ResourceManagerNode(model, found, journal),
        }
        self._attach(layer)
        for make in self._makers.values():
            self._attach(make())
        for node in nodes:
            self._attach(node)
        for make_hooks in hooks:
            self._manage(model, make_hooks)
        for skill in model.skills if mocks else ():
            if skill.name not in self.hooks:
                name = skill_process(skill.name)
                self._makers[name] = lambda skill=skill.name: make_mock_skill(model, skill, script)
                self._attach(self._makers[name]())
        numbers = count(1)
        types = {skill: type(each) for skill, each in self.hooks.items()}
        bus = self.network.bus(CLIENT)
        super().__init__(bus, model, layer, types=types, new_goal_id=lambda: f"goal-{next(numbers)}")
        self.set_data(**(data or {}))

    def close(self) -> None:
        """Shut down every node in order. A running goal is ended first. Idempotent."""
        for name, (node, bus) in reversed(list(self._running.items())):
            node.detach()
            bus.close()
            del self._running[name]
        super().close()

    def kill(self, process: str) -> None:
        """Kill a node at once, as by kill -9. Raises UnknownNameError for one that does not run."""
        if process not in self._running:
            raise UnknownNameError("running node", process, self._running)
        _, bus = self._running.pop(process)
        bus.close()

    def restart(self, process: str) -> None:
        """Restart a killed manager. The resource manager continues from its journal, others lose their memory.

        Raises UnknownNameError for any other node.
        """
        if process not in self._makers:
            raise UnknownNameError("manager", process, self._makers)
        self._attach(self._makers[process]())
        self.run(0.1)

    def _manage(self, model: Skillset, make_hooks: HooksFactory) -> None:
        """Run the manager of the skill with these hooks. Each restart makes new ones."""
        if isinstance(make_hooks, SkillHooks):
            kind = type(make_hooks).__name__
            raise TypeError(f"These hooks of {kind} are made already. Give the class, or a function that makes them.")

        def make() -> Node:
            made = make_hooks()
            self.hooks[made.skill] = made
            return SkillManagerNode(made, model)

        node = make()
        self._makers[node.name] = make
        self._attach(node)

    def _attach(self, node: Node) -> None:
        self._running[node.name] = (node, self.network.attach(node))
