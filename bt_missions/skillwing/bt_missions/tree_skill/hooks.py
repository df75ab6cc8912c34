"""Hooks of a skill that runs a tree file, or an `.rlc` file, over other skills of its robot.

class FetchManager(TreeHooks, AbstractFetchManager):
    skillset_file = SKILLSET
    tree_file = Path(__file__).with_name("fetch.xml")
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import msgspec
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.tree_skill.checks import body_problems, read_body
from skillwing.bt_missions.xml.blackboard import Blackboard
from skillwing.bt_missions.xml.builder import Builder
from skillwing.bt_missions.xml.document import TreeFileError
from skillwing.bt_missions.xml.tree_file import TreeFile
from skillwing.dsl import load
from skillwing.dsl.model import Field
from skillwing.dsl.suggest import did_you_mean, listed
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.errors import InvalidOptionError
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.protocol import Keys, RecordKind, Terminal
from skillwing.services.timeline import Timeline

TICK_PERIOD = 0.2
"""Longest time between two ticks, in seconds of robot time; after a change a tick follows at once."""


class TreeHooks(SkillHooks[Any, Any, Any]):
    """Runs the main tree of `tree_file` for each goal. The skill owns the goals that the tree starts.

    The inputs of the goal are entries of the tree: `{rack}`. Entries with the names of outputs and feedback fields fill
    these. SUCCESS ends the goal with `success`, FAILURE with `failure`: by default with the first result of that kind,
    and without one as ERROR. An interrupt, and every other end, halts the tree. It is confirmed when all goals of the
    tree have ended.

    `setup` raises TreeFileError with all problems of the tree, also with the trees of other skills beside its file. It
    raises InvalidOptionError if `success` or `failure` is no such result of the skill.
    """

    skillset_file: ClassVar[Path]
    tree_file: ClassVar[Path]
    success: ClassVar[str | None] = None
    failure: ClassVar[str | None] = None

    def setup(self) -> None:
        self._skillset = load(self.skillset_file)
        self._model = self._skillset.skill(self.skill)
        self._source = read_body(self.tree_file, self._skillset)
        problems = body_problems(self._source, self._skillset, self.skill, self.tree_file.parent)
        if problems:
            # The launcher shows the last line of the log.
            raise TreeFileError(self.tree_file, (problem.without_excerpt() for problem in problems))
        self._results = {
            Status.SUCCESS: self._result("success", self.success),
            Status.FAILURE: self._result("failure", self.failure),
        }
        self._run: TreeRun | None = None
        self._timeline = Timeline(self.bus, Keys(self._skillset.name))
        self._interface = SkillsetInterface(self.bus, self._skillset, client=self.skill, owns_goals=True)
        self._interface.on_change(self._wake)
        self.bus.every(TICK_PERIOD, self._wake)

    def on_dispatch(self, goal: Goal[Any]) -> None:
        context = MissionContext(self._interface, self._skillset, self.bus.now, self._write_record)
        context.observe("", self.record)
        self._run = TreeRun(goal, self._source, context, self._conclude)
        self._wake()

    def progress(self, goal: Goal[Any]) -> Any:
        run = self._run
        return None if run is None or self.Feedback is None else run.struct(self.Feedback, self._model.feedback)

    def on_interrupt(self, goal: Goal[Any]) -> None:
        if self._run is None:
            self.interrupted(goal.id)
        else:
            self._run.halt(lambda: self.interrupted(goal.id), self.record)

    def on_ended(self, goal: Goal[Any], terminal: Terminal) -> None:
        if self._run is not None and self._run.goal.id == goal.id:
            self._run.halt(lambda: None, self.record)

    def _wake(self) -> None:
        if self._run is not None:
            self._run.tick()

    def _conclude(self, goal: Goal[Any], status: Status, text: str, cause: str | None) -> None:
        """End the goal after the tree has ended by itself. text: its last failure."""
        run = self._run
        result = self._results[status]
        if result is None or run is None:
            self.failed(goal.id, text or f"The tree ended {status.value}.", cause=cause)
            return
        output = None if self.Outputs is None else run.struct(self.Outputs, self._model.outputs)
        if self._model.outputs and output is None:
            self.failed(goal.id, 'The tree has set none of the outputs. Write them: `out="{name}"`.', cause=cause)
            return
        why = "" if status is Status.SUCCESS else text.removesuffix(".")
        self.terminated(goal.id, result, output, cause=cause, why=why)

    def _result(self, kind: str, named: str | None) -> str | None:
        """The result for an end of the tree; None if the skill has none of that kind. Raises InvalidOptionError."""
        names = [result.name for result in self._model.results if result.success is (kind == "success")]
        if named is None:
            return next(iter(names), None)
        if named not in names:
            hint = did_you_mean(named, names, f"; there is {listed(names)}.")
            text = f"`{kind}` of `{type(self).__name__}` is `{named}`, which is no {kind} of `{self.skill}`{hint}"
            raise InvalidOptionError(kind, text)
        return named

    def _write_record(self, subject: str, before: str | None, after: str, text: str, cause: str | None) -> str:
        return self._timeline.record(RecordKind.MISSION, subject, before, after, text=text, cause=cause)


class TreeRun:
    """One run of a tree, from the dispatch of its goal until the goals that it has started have ended."""

    def __init__(
        self,
        goal: Goal[Any],
        source: TreeFile,
        context: MissionContext,
        conclude: Callable[[Goal[Any], Status, str, str | None], None],
    ) -> None:
        self.goal = goal
        self._context = context
        self._conclude = conclude
        self._blackboard = Blackboard()
        inputs = {} if goal.inputs is None else msgspec.to_builtins(goal.inputs)
        for name, value in inputs.items():
            self._blackboard.entry(name).set(value)
        builder = Builder(source, context)
        self._tree: Behaviour = builder.build(source.main, self._blackboard)
        self._after: Callable[[], None] | None = None
        """Call for the moment when all goals have ended; None while the tree runs."""

    def tick(self) -> None:
        if self._after is None:
            self._tick_tree()
        if self._after is not None and not self._context.reaper.unfinished:
            after, self._after = self._after, lambda: None
            after()

    def halt(self, after: Callable[[], None], cause: str | None) -> None:
        """Halt the tree, and call `after` when the goals that it has started have ended. cause: record for the halt."""
        self._context.observe("halted", cause)
        self._tree.stop(Status.INVALID)
        self._settle(after)
        self.tick()

    def struct(self, kind: type[Any], fields: tuple[Field, ...]) -> Any:
        """A structure of the entries with the names of its fields; None while one of them has no value."""
        entries = {field.name: self._blackboard.entry(field.name) for field in fields}
        if not all(entry.is_filled for entry in entries.values()):
            return None
        try:
            return msgspec.convert({name: entry() for name, entry in entries.items()}, kind)
        except (LookupError, msgspec.ValidationError):
            return None

    def _tick_tree(self) -> None:
        self._tree.tick_once()
        if self._tree.status in (Status.SUCCESS, Status.FAILURE):
            status, failure = self._tree.status, self._context.failure
            text, cause = ("", None) if failure is None or status is Status.SUCCESS else (failure.text, failure.record)
            self._settle(lambda: self._conclude(self.goal, status, text, cause))

    def _settle(self, after: Callable[[], None]) -> None:
        self._after = after
        self._context.cancel_all()
