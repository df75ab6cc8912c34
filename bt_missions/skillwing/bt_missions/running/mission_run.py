"""One run of a mission, from the wait for the robot to the final status.

Stages in this order:

- WAITING until the robot is ready
- RUNNING the first tree
- CHECKING for a robot away from its rescue goal, after the end of that tree: it waits for the robot's report
- RESCUING with the second tree, if the first one stopped or left the robot away from its goal
- STOPPING until every goal has ended
- OVER
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.mission.mission import Mission, MissionTrees
from skillwing.bt_missions.running.leaf_errors import mark_raising_leaf
from skillwing.bt_missions.running.link_wait import LinkWait
from skillwing.bt_missions.running.pause_state import PauseControl, PauseState
from skillwing.bt_missions.running.progress_text import progress_text
from skillwing.bt_missions.running.publisher import MissionPublisher
from skillwing.bt_missions.running.robots_of_run import RobotOfRun, RobotsOfRun, rescue_tree, rescued_words
from skillwing.bt_missions.running.run_conditions import CLOCK_TIMEOUT, ClockWatchdog
from skillwing.services.bus import Bus, Handle
from skillwing.services.protocol import MissionPhase

SETTLED_TICK = 0.01
"""Time from a tick that changed something to the next one, in seconds of robot time."""
ARRIVAL_REPORT = 0.2
"""Longest wait for the robot's report that it has reached its rescue goal, after the end of its skill, in seconds of
robot time. The robot reports it by itself, so that no step tells when it comes."""
SETTLE_TIMEOUT = 15.0
"""Longest wait at the end for goals that do not stop, in seconds of wall time."""


class RunStage(StrEnum):
    WAITING = "waiting"
    RUNNING = "running"
    CHECKING = "checking"
    RESCUING = "rescuing"
    STOPPING = "stopping"
    OVER = "over"


class MissionRun:
    """Runs `trees` for `mission`. It needs a tick after each change, and calls `wake` after its own changes.

    buses: of the robots, in their order; all have one thread.
    """

    def __init__(
        self,
        buses: Sequence[Bus],
        mission: Mission,
        trees: MissionTrees,
        context: MissionContext,
        publisher: MissionPublisher,
        wake: Callable[[], None],
        link: LinkWait,
    ) -> None:
        self._buses = tuple(buses)
        self._trees = trees
        self._mission_file = mission.file
        self._context = context
        self._publisher = publisher
        self._wake = wake
        self._link = link
        self._robots = RobotsOfRun(mission, context, trees)
        self._rescued: tuple[RobotOfRun, ...] = self._robots.rescuable
        """The robots of the rescue that runs, or that would run now."""
        self._stage = RunStage.WAITING
        self._outcome = MissionPhase.IDLE, ""
        self._abort_reason: str | None = None
        self._has_run = False
        self._system_is_there = True
        self._report_is_overdue = False
        self._looks_again = False
        """True if a robot that becomes the mission's to rescue again, before the end, is rescued."""
        self._lingers = False
        """True while robots whose rescue failed may report that they have left their goals."""
        self._settle_timer: Handle | None = None
        self._settling_is_overdue = False
        self._at_end: list[Handle] = []
        publisher.rescue = self.rescue_action or ""
        self._show(trees.root)

    @property
    def tree_shows_end(self) -> bool:
        """True if the tree shows why the mission ended: it has run, and the system was there until its end."""
        return self._has_run and self._system_is_there

    @property
    def rescue_action(self) -> str | None:
        """Noun for the second tree; None without one."""
        return self._robots.rescue_action

    def cancel_at_end(self, *handles: Handle) -> None:
        """Cancel these when the run is over."""
        self._at_end += handles

    def time_is_known(self, robot: str) -> None:
        """Note that the time of a robot is known from now on."""
        self._robots.time_is_known(robot)
        self._wake()

    def tick(self) -> None:
        match self._stage:
            case RunStage.WAITING:
                self._start_when_ready()
            case _ if self._link.is_away:
                return  # what is known of the robot is old: nothing may be started or judged by it
            case RunStage.RUNNING:
                self._tick_root()
            case RunStage.CHECKING:
                self._check_place()
            case RunStage.RESCUING:
                self._rescue()
            case RunStage.STOPPING | RunStage.OVER:
                pass
        if self._stage is RunStage.STOPPING:
            self._finish_when_stopped()
        if self._stage in (RunStage.RUNNING, RunStage.RESCUING) and self._publisher.publish_tree():
            self._publish_progress()
            # The next tick may continue from what this one changed, such as the end of a round.
            self._after(SETTLED_TICK, self._wake)

    def _after(self, delay: float, action: Callable[[], None]) -> list[Handle]:
        """Call `action` after this robot time of any robot: the time of one that is lost stands still."""
        return [bus.after(delay, action) for bus in self._buses]

    # --- requests of the operator

    def abort(self, reason: str) -> None:
        """Interrupt everything, rescue the robot, and end as ABORTED. A second call has no effect."""
        if self._stage not in (RunStage.WAITING, RunStage.RUNNING):
            return
        self._abort_reason = reason
        self._end(MissionPhase.ABORTED, reason, rescue=self._stage is RunStage.RUNNING)
        # At once, as the reply to the request carries this status.
        if self._stage is RunStage.RESCUING:
            self._publisher.publish(MissionPhase.RUNNING, self._rescue_text)
        else:
            phase = MissionPhase.RUNNING if self._has_run else MissionPhase.IDLE
            self._publisher.publish(phase, self._outcome[1])
        self._wake()

    def pause(self, reason: str) -> str | None:
        """Hold the mission until `resume`. Returns a sentence if that is not possible.

        Guards stay active: they may still end the mission.
        """
        if self._stage is not RunStage.RUNNING:
            return f"The mission is {self._stage}; only one that runs can be paused."
        refusal = self._pause.pause(reason)
        if refusal is None:
            self._publish_pause_state()
            self._wake()
        return refusal

    def resume(self, reason: str) -> str | None:
        """Continue where the mission was paused. Returns a sentence if that is not possible."""
        refusal = self._pause.resume()
        if refusal is None:
            self._publish_pause_state(reason)
            self._wake()
        return refusal

    # --- wait for the robot

    def _start_when_ready(self) -> None:
        missing = self._robots.missing
        if not missing:
            self._stage = RunStage.RUNNING
            self._has_run = True
            self._robots.begin()
            self._publisher.enter(MissionPhase.RUNNING, "the robot is ready")
            now, is_away = self._context.now, lambda: self._link.is_away
            self._at_end.append(ClockWatchdog(self._buses[0], now, self._give_up_for_clock, is_away))
            self._at_end.append(self._link.begin(self._wake, self._give_up_for_link))
            self._tick_root()
        elif self._publisher.status.text != missing:
            self._publisher.publish(MissionPhase.IDLE, missing)

    def give_up_waiting(self, waited: float) -> None:
        """End the mission if the robot is not ready after so many seconds."""
        if self._stage is RunStage.WAITING:
            self.give_up(f"The robot did not get ready within {waited:g} s ({self._robots.missing}).")

    def give_up_away(self) -> None:
        """End the mission if it waits for a robot that is away from its rescue goal, and that nobody commands."""
        refusal = self._robots.refusal
        if self._stage is RunStage.WAITING and refusal is not None:
            self.give_up(refusal)

    # --- run of the trees

    def _tick_root(self) -> None:
        status = self._tick_tree(self._trees.root)
        if status is Status.SUCCESS:
            self._tree_ended(MissionPhase.SUCCEEDED, self._publisher.progress.text or "done")
        elif status is Status.FAILURE:
            self._tree_ended(MissionPhase.FAILED, self._failure_text())

    def _rescue(self) -> None:
        status = self._tick_tree(self._tree)
        if status in (Status.SUCCESS, Status.FAILURE):
            phase, text = self._outcome
            reached, action = rescued_words(self._rescued)
            done = status is Status.SUCCESS
            rescued = reached if done else f"{action} failed: {self._failure_text()}"
            if not done and self._rescued_are_there:
                # A robot that had not left its goal refuses the way there. Its report that it has left may be late.
                self._lingers = True
                self._at_end += self._after(ARRIVAL_REPORT, self._note_place)
            # A rescue that a person prevents may become possible again. One that fails by itself is not repeated.
            self._looks_again = not self._robots.due
            self._end(phase, _joined(text, rescued), rescue=False)

    @property
    def _rescued_are_there(self) -> bool:
        return all(each.safety.is_reached for each in self._rescued)

    def _note_place(self) -> None:
        """Note that robots whose rescue failed are at their goals all the same."""
        if self._lingers and self._rescued_are_there:
            phase, text = self._outcome
            self._outcome = phase, _joined(text, rescued_words(self._rescued)[0])
        self._lingers = False
        self._wake()

    def _tick_tree(self, tree: Behaviour) -> Status:
        """Tick once. If a leaf of the first tree raises, the second one rescues the robot."""
        try:
            tree.tick_once()
        except Exception as error:  # noqa: BLE001 - the robot may need its rescue, so no exception may end the process
            text = mark_raising_leaf(tree, error, self._mission_file)
            if self._stage is RunStage.RESCUING:
                phase, reason = self._outcome
                self._end(phase, _joined(reason, f"during {self.rescue_action} {text}"), rescue=False)
            else:
                self._end(MissionPhase.FAILED, text, rescue=True)
            return Status.INVALID
        return tree.status

    def _failure_text(self) -> str:
        """Reasons of the mission's failure: why the tree switched to its last branch, then the last failure."""
        reasons = [switch.reason for switch in self._context.switches if switch.subject == "mission"]
        if self._context.failure is not None:
            reasons.append(self._context.failure.text)
        first, *later = dict.fromkeys(reasons) or ["the tree failed"]
        return _joined(first, *(f"then {reason}" for reason in later))

    @property
    def _failure_cause(self) -> Mapping[str, str | None]:
        """Record of the first of these reasons, by robot: the switch to the last branch, else the last failure."""
        switch = next((each for each in self._context.switches if each.subject == "mission"), None)
        first = switch or self._context.failure
        return {} if first is None else {first.robot: first.record}

    def _show(self, tree: Behaviour) -> None:
        """Run and publish this tree from now on."""
        self._tree = tree
        self._pause = PauseControl(tree, self._context)
        self._publisher.show(tree, self._trees.progress)

    def _publish_progress(self) -> None:
        if self._stage is RunStage.RESCUING:
            self._publisher.publish_if_changed(MissionPhase.RUNNING, self._rescue_text)
            return
        state = self._publish_pause_state()
        self._publisher.publish_if_changed(state.phase, state.reason or progress_text(self._tree))

    def _publish_pause_state(self, reason: str = "") -> PauseState:
        """Publish a change between RUNNING, PAUSED and HELD. It is the cause of what the tree does next."""
        state = self._pause.state
        if state.phase != self._publisher.status.phase:
            text = reason or state.reason or self._context.last_observation
            records = self._publisher.enter(state.phase, text, {state.robot: state.cause})
            for name, own in self._context.robots.items():
                own.follow(records[name])
            self._context.observe(text, None)
        return state

    @property
    def _rescue_text(self) -> str:
        return _joined(self._outcome[1], self.rescue_action or "")

    # --- end

    def give_up(self, text: str) -> None:
        """End as FAILED without a rescue."""
        self._end(MissionPhase.FAILED, text, rescue=False)
        self._wake()

    def _give_up_for_clock(self) -> None:
        if self._stage in (RunStage.RUNNING, RunStage.CHECKING, RunStage.RESCUING):
            text = f"robot time stands still for {CLOCK_TIMEOUT:g} s"
            if self._stage is RunStage.RUNNING and self._context.failure:
                text = _joined(self._failure_text(), f"then {text}")
            self._end(*self._cut_short(MissionPhase.FAILED, text), rescue=False)
            self._wake()

    def _give_up_for_link(self) -> None:
        """End at once, when the link was away for too long: nothing can be interrupted or heard."""
        self._system_is_there = False
        text = f"the link to the robot was away for {self._link.limit:g} s"
        self._stop_tree(*self._cut_short(MissionPhase.FAILED, text))
        self._conclude(*self._outcome)

    def stop(self) -> None:
        """Interrupt what still runs and publish the end of the mission, without waiting for replies."""
        if self._stage is not RunStage.OVER:
            phase, text = self._cut_short(MissionPhase.ABORTED, "the mission's process was stopped")
            self._end(phase, self._abort_reason or text, rescue=False)
            self._finish()

    def _cut_short(self, phase: MissionPhase, text: str) -> tuple[MissionPhase, str]:
        """Outcome of a run that is cut short: a failure or an abort before it stays what it is, and every reason."""
        ended, before = self._outcome
        if ended in (MissionPhase.FAILED, MissionPhase.ABORTED):
            phase = ended
        return phase, f"{text}; before that: {before}" if before else text

    def system_stopped(self) -> None:
        """End at once: the system was stopped, so that nothing can be interrupted."""
        if self._stage is RunStage.OVER:
            return
        phase, before = self._outcome
        where = f", with the robot {self._robots.where}" if self._robots.where else ""
        after = f"; before that: {before}" if before else ""
        self._system_is_there = False
        text = f"the system was stopped under it{where}{after}"
        self._stop_tree(MissionPhase.ABORTED if phase is MissionPhase.IDLE else phase, text)
        self._conclude(*self._outcome)

    def _end(self, phase: MissionPhase, text: str, *, rescue: bool) -> None:
        """Halt the tree. Then rescue the robot with the second tree, or wait for the goals to stop."""
        self._stop_tree(phase, text)
        if rescue and self._robots.rescuable:
            self._begin_rescue(self._robots.rescuable)
        else:
            self._settle()

    def _tree_ended(self, phase: MissionPhase, text: str) -> None:
        """Note the end of the first tree, and check that it has not left the robot away from its goal."""
        self._stop_tree(phase, text)
        self._looks_again = True
        self._stage = RunStage.CHECKING
        self._check_place()
        if self._stage is RunStage.CHECKING:
            waits = f"waiting for the robot's report of {self._robots.reported} ({self._robots.where} so far)"
            self._publisher.publish(MissionPhase.RUNNING, _joined(text, waits))
            self._at_end += self._after(ARRIVAL_REPORT, self._note_overdue_report)

    def _note_overdue_report(self) -> None:
        self._report_is_overdue = True
        self._wake()

    def _check_place(self) -> None:
        """Rescue a robot that stays away. The end of the skill may arrive before the robot reports its new state."""
        due = self._robots.due
        if not due:
            self._settle()
        elif self._report_is_overdue:
            self._rescue_after_all(due)

    def _rescue_after_all(self, due: tuple[RobotOfRun, ...]) -> None:
        phase, text = self._outcome
        self._outcome = phase, _joined(text, f"it ended {self._robots.where}")
        self._begin_rescue(due)

    def _stop_tree(self, phase: MissionPhase, text: str) -> None:
        self._outcome = phase, text
        self._publisher.publish_tree()  # its last state, before the halt resets the statuses
        try:
            self._tree.stop(Status.INVALID)
        except Exception as error:  # noqa: BLE001 - the goals have to be interrupted all the same
            self._outcome = phase, _joined(text, f"halting the tree raised {type(error).__name__}: {error}")
        self._context.cancel_all()

    def _begin_rescue(self, robots: tuple[RobotOfRun, ...]) -> None:
        if self._settle_timer is not None:
            self._settle_timer.cancel()
        self._stage = RunStage.RESCUING
        self._rescued = robots
        self._show(rescue_tree(robots))

    def _settle(self) -> None:
        self._stage = RunStage.STOPPING
        self._settling_is_overdue = False
        self._start_settle_timer()

    def _start_settle_timer(self) -> None:
        self._settle_timer = self._buses[0].after(SETTLE_TIMEOUT, self._note_overdue_settling, wall=True)
        self._at_end.append(self._settle_timer)

    def _note_overdue_settling(self) -> None:
        """Note the end of the wait. It begins again if the link is away: nothing is heard of goals and robots."""
        if self._link.is_away:
            self._start_settle_timer()
        else:
            self._settling_is_overdue = True
            self._wake()

    def _finish_when_stopped(self) -> None:
        """Finish when every goal has stopped, or its time to stop is over.

        If a person gives the robot back meanwhile, rescue it first.
        """
        due = self._robots.due
        if self._looks_again and due:
            self._looks_again = self._lingers = False
            self._rescue_after_all(due)
        elif self._settling_is_overdue or not (self._lingers or self._context.unfinished):
            self._finish()

    def _finish(self) -> None:
        """Finish, whatever still runs."""
        if self._stage is RunStage.OVER:
            return
        phase, text = self._outcome
        running = {
            f"{robot}: {goal.skill}" if robot else goal.skill
            for robot, context in self._context.robots.items()
            for goal in context.unfinished
        }
        if running:
            text = _joined(text, "these did not stop: " + ", ".join(sorted(running)))
        self._conclude(phase, text)

    def _conclude(self, phase: MissionPhase, text: str) -> None:
        self._stage = RunStage.OVER
        self._publisher.enter(phase, text, self._failure_cause if phase is MissionPhase.FAILED else {})
        for handle in self._at_end:
            handle.cancel()


def _joined(*clauses: str) -> str:
    """One sentence of several clauses: only the last one keeps its full stop."""
    *first, last = clauses
    return "; ".join([*(clause.removesuffix(".") for clause in first), last])
