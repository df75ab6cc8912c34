"""Hooks: code by the developer of a skill, called by the skill's manager."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from skillwing.services.bus import Bus
from skillwing.services.protocol import Terminal

I = TypeVar("I")  # noqa: E741
O = TypeVar("O")  # noqa: E741
F = TypeVar("F")


@dataclass(frozen=True, slots=True)
class Goal(Generic[I]):
    """A goal, as its skill's hooks get it.

    inputs: in range, defaults filled in. token: fencing token of the grant, to be sent with every command to the
    functional layer; 0 during `validate`. started_at: robot time in seconds at which the start arrived.
    """

    id: str
    inputs: I
    token: int
    started_at: float


class GoalControl(Protocol):
    """Calls of hooks to the manager that runs their goal."""

    def terminated(self, goal_id: str, result: str, output: object, cause: str | None, why: str) -> None: ...
    def interrupted(self, goal_id: str) -> None: ...
    def failed(self, goal_id: str, reason: str, cause: str | None) -> None: ...


class SkillHooks(Generic[I, O, F]):
    """Base of the generated `Abstract<Skill>Manager` classes.

    All hooks, and all callbacks registered through `self.bus`, run one at a time on one thread. They have to return
    soon, and need no locks. An exception in any of them ends the running goal as ERROR; the process
    lives on. Calls of `terminated`, `interrupted` and `failed` for a goal that is over are dropped.
    """

    skill: ClassVar[str]
    Inputs: ClassVar[type[Any] | None] = None
    Outputs: ClassVar[type[Any] | None] = None
    Feedback: ClassVar[type[Any] | None] = None

    bus: Bus
    """The network, from `setup` on."""
    current: Goal[I] | None = None
    """The goal from its dispatch to its end."""
    record: str | None = None
    """Id of the timeline record of the goal's last change. It is the cause of the hooks' own records."""
    _control: GoalControl

    def bind(self, bus: Bus, control: GoalControl) -> None:
        """Connect the hooks to the manager, which calls this before `setup`. Developers do not call it."""
        self.bus = bus
        self._control = control

    # --- to override -----------------------------------------------------------------------------------------------

    def setup(self) -> None:
        """Subscribe to the functional layer. The manager calls it once, before any goal."""

    def validate(self, goal: Goal[I]) -> str | None:
        """Return None to accept the goal, or a sentence on its problem. The goal then ends NV.

        Types and ranges of the model are checked before. Move nothing here: preconditions are checked afterwards. It is
        also called for a modification, while `current` is the goal with its old inputs. A sentence then refuses the
        modification, and the goal goes on.
        """
        del goal
        return None

    def on_dispatch(self, goal: Goal[I]) -> None:
        """Start the functional layer. The goal holds its grant; it is RUNNING when this returns."""

    def progress(self, goal: Goal[I]) -> F | None:
        """Return feedback, or None to publish nothing. Called at each progress period while the goal is RUNNING."""
        del goal
        return None

    def on_modify(self, goal: Goal[I]) -> None:
        """Go on with the new inputs of the running goal. `validate` has accepted them.

        A skill with modifiable inputs overrides it. Otherwise its manager refuses modifications.
        """

    def on_interrupt(self, goal: Goal[I]) -> None:
        """Ask the functional layer to stop, and return. Call `interrupted` when it has stopped.

        The default has nothing to stop and confirms at once.
        """
        self.interrupted(goal.id)

    def on_ended(self, goal: Goal[I], terminal: Terminal) -> None:
        """Clean up after a goal that has ended for any reason: stop everything that still runs for it.

        It is called once for every dispatched goal, after its terminal answer.
        """

    # --- to call ---------------------------------------------------------------------------------------------------

    def terminated(
        self, goal_id: str, result: str, output: O | None = None, *, cause: str | None = None, why: str = ""
    ) -> None:
        """End the goal with a result of the skill; the generated `terminated_<RESULT>` call this.

        cause: id of the timeline record that led to this end, such as a resource's last change. Without it the cause of
        a success is the goal's last record. A failure then comes of the request to stop, or is the root of a chain.
        why: a phrase for the goal's reason, such as `no view of the way ahead`.
        """
        self._control.terminated(goal_id, result, output, cause, why)

    def interrupted(self, goal_id: str) -> None:
        """Confirm that the interrupted skill has stopped."""
        self._control.interrupted(goal_id)

    def failed(self, goal_id: str, reason: str, *, cause: str | None = None) -> None:
        """End the goal as ERROR, with the skill's lost effect. cause: as in `terminated`."""
        self._control.failed(goal_id, reason, cause)
