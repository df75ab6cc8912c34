"""Promises on the state of managers and clients: at all times, and after a time without faults."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

import msgspec

from simulation.observer import Observer
from simulation.plan import CLIENTS
from simulation.world import Client, Process, World
from skillwing.dsl.expressions import Environment, evaluate, names_used
from skillwing.services.bus import Answered, Refused
from skillwing.services.bus.inprocess import InProcessBus, SentMessage
from skillwing.services.client.retry import LONGEST_DELAY
from skillwing.services.core.goal_states import Executing, Finished, Finishing, GoalRun, Stopping
from skillwing.services.managers.liveliness_monitor import LOSS_DEBOUNCE
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import Ending, GoalStatus, State

SLACK = 0.05
"""Seconds of virtual time that a timer may be late: others come first at the same instant."""
ASKED_AGAIN_WITHIN = 2.0 + LONGEST_DELAY
"""Seconds from a question to its repetition: the time limit of an answer, and the longest pause after a silence."""
TOKEN_DELAY = 5.0
"""Longest time in seconds by which the return of a token may arrive late: a slow message, and a slow reconnection."""
LOCAL_OUTCOME = "record_outcome"
MOST_SILENCES = 10
"""Most silences of the resource manager in a row. After them a goal ends without it."""


@dataclass
class Asking:
    """A question to the resource manager. t: time of the last one; times: number in a row, by a connected process."""

    t: float
    times: int = 0


class Audit:
    """Checks of a world, which report broken promises to its observer."""

    def __init__(self, world: World, observer: Observer) -> None:
        self._world = world
        self._observer = observer
        self._subject = world.plan.subject
        self._askings: dict[tuple[InProcessBus, str, str], Asking] = {}

    def _note(self, law: str, text: str) -> None:
        self._observer.note(self._world.network.now(), law, text)

    # --- at all times ------------------------------------------------------------------------------------------------

    def look_at_grants(self) -> None:
        """Check that an exclusive resource is taken exactly while one grant holds it, and that invariants hold."""
        process = self._world.running.get("resource_manager")
        if process is None:
            return
        core = process.resource_core
        holders: Counter[str] = Counter()
        for grant in core.grants:
            holders.update(self._subject.takes[grant.skill.name])
        for resource, taken in self._subject.exclusive.items():
            held = core.states[resource] == taken
            if holders[resource] != held:
                names = [f"{grant.goal_id} of {grant.skill.name}" for grant in core.grants]
                text = f"{resource} is {core.states[resource]}; grants: {', '.join(names) or 'none'}"
                self._note("one holder, and none too many", text)
        for grant in core.grants:
            for invariant in grant.skill.invariants:
                expression = invariant.expression
                if names_used(expression, "data") or evaluate(expression, Environment(resources=core.states)):
                    continue
                text = f"{grant.goal_id} of {grant.skill.name} goes on although `{invariant.name}` does not hold"
                self._note("invariants hold", text)

    def look_at_question(self, said: SentMessage) -> None:
        """Check that a question is asked ten times at most, and that no goal asks for its end while it moves."""
        call: dict[str, Any] = msgspec.msgpack.decode(said.payload)
        goal_id = call["goal_id"]
        what = call["type"]
        if what == "renew":
            return
        for process in self._world.skill_managers:
            run = _pending(process).get(goal_id) if what == LOCAL_OUTCOME else process.skill_core.current
            if process.bus is not said.source or run is None or run.goal_id != goal_id:
                continue
            self._look_at_patience(process, what, goal_id)
            if what == "end" and call["how"] == "interrupt" and run.status is not None:
                book = self._world.logbook
                patience = process.skill_core.skill.interrupt.timeout
                moves = book.dispatched[goal_id] and goal_id not in book.stood_still
                if moves and said.t < run.status.t + patience - SLACK:
                    self._note("resources are kept until the skill stands still", f"{goal_id} was still moving")

    def _look_at_patience(self, process: Process, what: str, goal_id: str) -> None:
        """Count the silences to a question. An answer would end it, so that every repetition means a silence."""
        now = self._world.network.now()
        asking = self._askings.setdefault((process.bus, what, goal_id), Asking(now))
        # A silence does not count while the process is cut off, or did not run.
        undisturbed = process.bus.connected and asking.t >= max(process.ran_since, process.linked_since)
        asking.t, asking.times = now, asking.times + 1 if undisturbed else 0
        if asking.times > MOST_SILENCES:
            self._note("waiting ends", f"{process.name} asks for the {what} of {goal_id} for the {asking.times}th time")

    def look_at_goals(self) -> None:
        """Check running processes: goals are not INTERRUPTING beyond their timeout, and waiting goals ask again."""
        for process in self._world.skill_managers:
            if process.stopped:
                continue
            for pending in _pending(process).values():
                if pending.status is not None:
                    self._look_at_waiting(process, pending, pending.status.t, LOCAL_OUTCOME)
            run = process.skill_core.current
            if run is None or run.status is None:
                continue
            self._look_at_grace(run, run.status)
            if not isinstance(run.state, Executing):
                self._look_at_waiting(
                    process, run, run.status.t, "end" if isinstance(run.state, Finishing) else "begin"
                )
            elif isinstance(run.state, Stopping):
                limit = max(run.status.t, process.ran_since) + process.skill_core.skill.interrupt.timeout
                if self._world.network.now() > limit + SLACK:
                    self._note("interrupting ends", f"{run.goal_id} is INTERRUPTING since {run.status.t:.3f}")

    def _look_at_grace(self, run: GoalRun, status: GoalStatus) -> None:
        """Check that a goal which is interrupted for its owner had no owner for its grace, as far as messages tell."""
        if not status.text.startswith("Its owner "):
            return
        away = [min(each.end, status.t) - each.begin for each in self._world.absences if each.begin <= status.t]
        if max(away, default=0.0) < LOSS_DEBOUNCE + run.owner_grace - TOKEN_DELAY:
            self._note("an owner has its grace", f"{run.goal_id} is interrupted at {status.t:.3f}: {status.text}")

    def _look_at_waiting(self, process: Process, run: GoalRun, since: float, what: str) -> None:
        asking = self._askings.get((process.bus, what, run.goal_id), Asking(since))
        if self._world.network.now() > max(asking.t, process.ran_since) + ASKED_AGAIN_WITHIN + SLACK:
            text = f"{process.name} asked for the {what} of {run.goal_id} at {asking.t:.3f}, and not again"
            self._note("waiting ends", text)

    # --- after a time without faults ---------------------------------------------------------------------------------

    def look_at_losses(self) -> None:
        """Check that lost goals run nowhere any more."""
        world = self._world
        held = {grant.goal_id for grant in world.resource_manager.resource_core.grants}
        for process in world.skill_managers:
            run = process.skill_core.current
            if run is None:
                continue
            if isinstance(run.state, Executing) and run.goal_id not in held:
                self._note("what is lost stops", f"{run.goal_id} runs without a grant in {process.name}")
            for client in world.clients:
                handle = client.node.goals.get(run.goal_id)
                if run.goal_id in client.node.unwanted and run.phase is not State.INTERRUPTING:
                    self._note("interrupts count", f"{run.goal_id} runs on, {client.name} has interrupted it")
                if handle is not None and handle.done and run.phase is not State.INTERRUPTING:
                    text = f"{run.goal_id} runs on, its client was told {handle.terminal.label}"
                    self._note("what is lost stops", text)
            policy = process.skill_core.skill.owner_lost
            orphan = run.owner is not None and CLIENTS[0] not in world.running
            if orphan and policy == "interrupt" and run.phase is not State.INTERRUPTING:
                self._note("nothing outlives its owner", f"{run.goal_id} runs on, and its owner is gone")
        self._look_at_hooks(at_rest=False)

    def is_quiet(self) -> bool:
        """True if no goal is left in any process, and every client has its answers."""
        world = self._world
        return (
            not world.resource_manager.resource_core.grants
            and all(each.skill_core.current is None and not _pending(each) for each in world.skill_managers)
            and all(not each.node.interface._trackers for each in world.clients)
        )

    def look_at_the_rest(self) -> None:
        """Check the end of a run: goals have ended, resources are free, clients know it, and nothing is left over."""
        world, observer = self._world, self._observer
        for process in world.replaced:
            self._note("who was replaced ends", f"{process.name} runs beside the process that has replaced it")
        manager = world.resource_manager
        for grant in manager.resource_core.grants:
            self._note("everything is released", f"{grant.goal_id} of {grant.skill.name} still holds a grant")
        for process in world.skill_managers:
            run = process.skill_core.current
            if run is not None:
                self._note("goals end", f"{run.goal_id} of {process.name} is still {run.phase}")
            for goal in _pending(process):
                self._note("goals end", f"{goal} of {process.name} still waits to be written down")
        for process in world.clients:
            self._look_at_client(process)
        self._look_at_hooks(at_rest=True)
        for process in world.running.values():
            if process.bus.unanswered:
                self._note("every request is answered", f"{process.name} owes {process.bus.unanswered} answers")
        if manager.node._leased._watch.keys:
            self._note("memory is bounded", f"leases of {manager.node._leased._watch.keys} are left over")
        if world.plan.calm:
            for goal, terminal in observer.terminals.items():
                if terminal.ending is Ending.LOST:
                    self._note("nothing is lost without a fault", f"{goal}: {terminal.reason}")

    def _look_at_client(self, process: Process) -> None:
        client: Client = process.node
        for goal, handle in client.goals.items():
            said = self._observer.terminals.get(goal)
            if handle.terminal is None:
                ended = f"ended {said.label}" if said else "is unknown"
                self._note("clients are told", f"{client.name} waits for {goal}, which {ended}")
            elif handle.terminal.detected_by != "client" and handle.terminal.label not in self._answers(goal):
                label = " or ".join(self._answers(goal)) or "nothing"
                text = f"{client.name} has {handle.terminal.label} for {goal}, its managers said {label}"
                self._note("one terminal answer", text)
        states = dict(self._world.resource_manager.resource_core.states)
        # Revisions have restarted without a journal: late messages of the killed manager then seem newer.
        if not self._books_were_lost() and dict(client.interface.states) != states:
            text = f"{client.name} believes {dict(client.interface.states)}, it is {states}"
            self._note("clients see the states", text)
        if client.interface._trackers:
            self._note("memory is bounded", f"{client.name} still tracks {list(client.interface._trackers)}")

    def _answers(self, goal: str) -> set[str]:
        """Reports of a goal's end: by its own manager, unless it died, and by the resource manager if that ended it."""
        verdict = self._observer.verdicts.get(goal)
        said = self._observer.answers.get(goal, set[str]())
        return said | {verdict} if verdict and (not said or self._books_were_lost()) else said

    def _books_were_lost(self) -> bool:
        """True if the resource manager was killed without a journal: its messages may then contradict earlier ones."""
        return not self._world.plan.journal and any(each.name == RESOURCE_MANAGER for each in self._world.fallen)

    def _look_at_hooks(self, *, at_rest: bool) -> None:
        """Check that each goal is dispatched once at most, and that `on_ended` follows once if its process lives."""
        book = self._world.logbook
        for goal, times in book.dispatched.items():
            if times > 1:
                self._note("nothing runs twice", f"{goal} was dispatched {times} times")
        self._look_at_modifications(at_rest=at_rest)
        for process in self._world.skill_managers if at_rest else ():
            for goal in process.node._hooks.ran:
                if book.ended[process.number, goal] != 1:
                    times = book.ended[process.number, goal]
                    self._note("what is lost stops", f"`on_ended` of {goal} ran {times} times in {process.name}")

    def _look_at_modifications(self, *, at_rest: bool) -> None:
        """Check that new inputs count once, in the order of a client's requests, and exactly as their answers say."""
        book, clients = self._world.logbook, [each.node for each in self._world.clients]
        for (process, goal), speeds in book.speeds.items():
            if len(set(speeds)) < len(speeds):
                self._note("modifications count once", f"process {process} got {speeds} for {goal}")
            for client in clients:
                asked = [speed for known, speed in client.modifications if known == goal]
                got = [speed for speed in speeds if speed in asked]
                if got != sorted(got, key=asked.index):
                    self._note("modifications keep their order", f"{client.name} asked {asked} for {goal}, not {got}")
            if book.last_speed.get((process, goal), speeds[-1]) != speeds[-1]:
                self._note("modifications count", f"{goal} ended with {book.last_speed[process, goal]}, not {speeds}")
        everything = {(goal, speed) for (_, goal), speeds in book.speeds.items() for speed in speeds}
        for client in clients if at_rest else ():
            for asked, answer in client.modifications.items():
                if answer is None:
                    self._note("clients are told", f"{client.name} waits for the modification {asked}")
                elif isinstance(answer, Answered) and asked not in everything:
                    self._note("answers are true", f"{client.name} was told that {asked} counts, and it does not")
                elif isinstance(answer, Refused) and asked in everything:
                    self._note("answers are true", f"{client.name} was told that {asked} is refused, and it counts")


def _pending(process: Process) -> dict[str, GoalRun]:
    """Goals with a local outcome that the resource manager has not confirmed and no client has got."""
    pending = process.skill_core._delivery.pending_outcomes
    return {goal: run for goal, run in pending.items() if not isinstance(run.state, Finished)}
