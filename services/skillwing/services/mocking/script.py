"""What a mock script says: how the goals of each skill go, what the world around them reports, and what it reacts to.

The classes are what a script file holds and what a test writes in Python (docs/mocks.md). Whether a script fits a
skillset is for `fitting.py` to judge.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, TypeAlias

import msgspec

from skillwing.services.errors import InvalidOptionError

DEFAULT_DELAY = 1.0
LONGEST = 1e9

Seconds: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=LONGEST)]
"""Robot time."""
Weight: TypeAlias = Annotated[float, msgspec.Meta(gt=0.0, le=LONGEST)]


class ScriptError(InvalidOptionError):
    """A mock script cannot be played. where: the script; problems: a sentence for each thing that is wrong in it."""

    def __init__(self, where: str, problems: Sequence[str]) -> None:
        self.where = where
        self.problems = tuple(problems)
        count = "a problem" if len(self.problems) == 1 else f"{len(self.problems)} problems"
        lines = "".join(f"\n  {problem}" for problem in self.problems)
        super().__init__("script", f"{where} has {count}. Change what is said here; docs/mocks.md has it all.{lines}")


class MockRun(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """How one goal goes.

    delay: robot time in seconds from the dispatch to the end, or the two bounds of a random one. At most one of these
    says what the end is; by default it is the skill's first success, and a skill without one runs until interrupted:
    result: a result's name; forever: it runs until interrupted; invalid: a sentence with which the goal is refused as
    NV; error: a sentence with which it ends ERROR; hang: the manager never answers again; crash: its process dies.
    output: of the result, by field; what is left out gets a valid value. progress: feedback by field, each a value or
    one that changes with time (`signals.py`). stop_delay: robot time from an interrupt to its confirmation.
    weight: how likely this run is among `Choices`.
    """

    # Without the bounds of `Seconds`: msgspec 0.22 crashes where a bounded number may also be a tuple.
    delay: float | tuple[float, float] = DEFAULT_DELAY
    result: str | None = None
    forever: bool = False
    invalid: str | None = None
    error: str | None = None
    hang: bool = False
    crash: bool = False
    output: dict[str, Any] = {}
    progress: dict[str, Any] = {}
    stop_delay: Seconds | Literal["never"] = 0.0
    weight: Weight = 1.0


class Choices(tuple[MockRun, ...]):
    """Runs among which each goal's is drawn by weight, rather than one after the other."""

    __slots__ = ()


class When(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, rename={"ending": "with"}):
    """What a reaction waits for: a resource that becomes a state, a skill that starts to run, or one that ends.

    ending: with these results (`ARRIVED`) or ways to end (`RI`, `N_ARRIVED`) only; in a file it is called `with`.
    """

    resource: str | None = None
    becomes: str | None = None
    starts: str | None = None
    ends: str | None = None
    ending: str | tuple[str, ...] = ()


class Reaction(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Something that the mocked world does: when something happens, or without `when` once, when it begins.

    after: seconds later. once: the first time only. trigger: extern transitions, as states by resource; fire: events;
    set: data from now on, as signals by name; end: results by skill with which their running goals end.
    """

    when: When | None = None
    after: Seconds = 0.0
    once: bool = False
    trigger: dict[str, str] = {}
    fire: str | tuple[str, ...] = ()
    set: dict[str, Any] = {}
    end: dict[str, str] = {}


class MockScript(msgspec.Struct, frozen=True, kw_only=True):
    """A whole script.

    skills: for each skill its runs, one after the other, the last of which repeats, or `Choices`; a skill that is not
    named does what `MockRun()` says. seed: of choices and random delays, 0 unless given. data: signals by name; others
    keep a valid value. resources: the states to which extern transitions bring resources at the beginning.
    """

    skills: Mapping[str, Sequence[MockRun]] = {}
    seed: int | None = None
    data: dict[str, Any] = {}
    resources: dict[str, str] = {}
    reactions: tuple[Reaction, ...] = ()
