"""All managers of a skillset in one process and virtual time, where a minute costs what its callbacks cost."""

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
from skillwing.services.testing.context import checked_states
from skillwing.services.testing.fake_layer import FakeLayer
from skillwing.services.testing.model import model_of

HooksFactory: TypeAlias = Callable[[], SkillHooks[Any, Any, Any]]
"""A class derived from SkillHooks, or any callable that makes such hooks: `lambda: DriveManager(fake_motor)`."""


class SkillsetInProcess(Bench):
    """A whole skillset: real managers around the hooks that are given, mocks for all other skills.

    skillset: the model, or the path of its file. hooks: what makes them, of any skills. mocks: False leaves the other
    skills without a manager; script: what the mocks do (docs/mocks.md). states: where resources are found at the
    start; they are placed there directly, whoever may drive them later. data: values that are published from the
    start, each at its promised period. layer: the fake functional layer. nodes: what else the robot needs. seed,
    jitter: of the time that messages take; with the same ones everything happens again.

    Raises SkillsetError for a file with errors, ContextError for a context that does not fit the model, TypeError for
    hooks that are made already.
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
        """By skill: the hooks that its manager runs."""
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
        """Shut every node down in good order: a goal that still runs is told that it has ended. Idempotent."""
        for name, (node, bus) in reversed(list(self._running.items())):
            node.detach()
            bus.close()
            del self._running[name]
        super().close()

    def kill(self, process: str) -> None:
        """Have a node die on the spot, as by kill -9. Raises UnknownNameError for one that does not run."""
        if process not in self._running:
            raise UnknownNameError("running node", process, self._running)
        _, bus = self._running.pop(process)
        bus.close()

    def restart(self, process: str) -> None:
        """Have a manager that was killed come back. The resource manager goes on from its journal, others know nothing.

        Raises UnknownNameError for any other node.
        """
        if process not in self._makers:
            raise UnknownNameError("manager", process, self._makers)
        self._attach(self._makers[process]())
        self.run(0.1)

    def _manage(self, model: Skillset, make_hooks: HooksFactory) -> None:
        """Run the manager of the skill whose hooks these are; each restart makes new ones."""
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
