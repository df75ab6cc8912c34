"""One run: a plan carried out under the eyes of a observer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from hashlib import sha256

from simulation.audit import Audit
from simulation.observer import Observer, Problem
from simulation.plan import ACTION_TIME, Deed, Plan, draw_plan
from simulation.world import World
from skillwing.services.bus.inprocess import SentMessage
from skillwing.services.managers.registration import REGISTRATION_PERIOD
from skillwing.services.protocol import InterruptGoal

CHECK_PERIOD = 0.25
FIXED_AT = ACTION_TIME + 1.0
WELL_FOR = 9.0
"""Seconds after which everybody has noticed everything: retries, probes, leases and their debouncing."""
REST_WITHIN = 25.0
REST_FOR = 1.0
ONE_OF_EACH_AFTER = 2 * REGISTRATION_PERIOD + 4.0
"""Seconds after which one process of each name is left. That the first of them woke up and attached last takes the
second a period to learn; that a third was started then takes the first one more. A lost question takes 3 s."""


@dataclass(frozen=True)
class Outcome:
    """problems: broken promises, none if all is well. messages: how many were sent. digest: of the whole run."""

    plan: Plan
    problems: tuple[Problem, ...]
    messages: int
    digest: str

    @property
    def laws(self) -> frozenset[str]:
        return frozenset(problem.law for problem in self.problems)


class Run:
    """Carries out a plan, and stops at the first broken promise."""

    def __init__(self, plan: Plan, on_message: Callable[[SentMessage], None] | None = None) -> None:
        self.plan = plan
        self.world = World(plan)
        self.observer = Observer(plan)
        self._audit = Audit(self.world, self.observer)
        self._on_message = on_message
        self._messages = 0
        self._digest = sha256()
        self._quiet = False
        self.world.network.tap = self._hear
        self.world.on_new_books = self.observer.expect_new_books
        now = self.world.network.now
        self.world.on_goal = lambda client, goal: self.observer.see_goal(now(), client, goal)
        self.world.on_change = lambda client: self.observer.see_states(now(), client)

    def carry_out(self) -> Outcome:
        network, observer = self.world.network, self.observer
        self.world.begin()
        network.schedule_periodic(CHECK_PERIOD, self._look)
        if self._pass_time(FIXED_AT):
            self.world.fix_all()
        if self._pass_time(FIXED_AT + WELL_FOR):
            self._audit.look_at_losses()
            self._interrupt_everything()
        network.run_until(lambda: bool(self._quiet or observer.problems), REST_WITHIN)
        rest_until = network.now() + REST_FOR
        if self.world.replaced:
            rest_until = max(rest_until, FIXED_AT + ONE_OF_EACH_AFTER)
        if self._pass_time(rest_until):
            self._audit.look_at_the_rest()
        return Outcome(self.plan, tuple(observer.problems), self._messages, self._digest.hexdigest())

    def _pass_time(self, until: float) -> bool:
        """True if no promise has been broken until then."""
        problems = self.observer.problems
        network = self.world.network
        if not problems:
            network.run_until(lambda: bool(problems), until - network.now())
        return not problems

    def _hear(self, said: SentMessage) -> None:
        self._messages += 1
        # Incarnations are drawn by chance that has no seed; they change nothing but some bytes.
        self._digest.update(f"{said.t!r} {said.source.name} {said.what} {said.key} {len(said.payload)}".encode())
        if self._on_message is not None:
            self._on_message(said)
        self._note_holds(said)
        self.observer.hear(said)
        if said.what == "reply" and said.source.name == "resource_manager":
            self._audit.look_at_grants()
        elif said.what == "ask" and said.key == self.world.keys.resource_goal:
            self._audit.look_at_question(said)

    def _note_holds(self, said: SentMessage) -> None:
        """Note which goals hold their resources, and who asks for it."""
        keys = self.world.keys
        if said.key in (keys.resource_steps, keys.resource_goal, keys.resource_attach) and said.what != "ask":
            self.observer.order.note_grants(said.t, self.world.resource_manager.resource_core)
        elif said.key == keys.resource_ready and said.what == "ask":
            client = next(each.node for each in self.world.clients if each.bus is said.source)
            self.observer.order.note_search(said.t, client)

    def _look(self) -> None:
        self._audit.look_at_grants()
        self._audit.look_at_goals()
        if self.world.network.now() > FIXED_AT + WELL_FOR:
            self._quiet = self._audit.is_quiet()

    def _interrupt_everything(self) -> None:
        """Some goals run until somebody has enough of them."""
        world = self.world
        for process in world.clients:
            for goal in process.node.goals:
                process.node.interrupt(goal)
        asker = world.running["robot"]
        for act in self.plan.acts:
            if act.deed in (Deed.START, Deed.START_AGAIN):
                request = InterruptGoal(goal_id=act.detail["goal"], client="robot")
                asker.node.insist(world.keys.interrupt(act.detail["skill"]), request)


def simulate(seed: int) -> Outcome:
    """Carry out the plan of a seed."""
    return Run(draw_plan(seed)).carry_out()
