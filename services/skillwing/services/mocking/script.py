"""The data model of a mock script: runs of each skill's goals, the reports of the world, and its reactions.

The classes are the contents of a script file, and tests in Python use them (docs/mocks.md). `fitting.py` fits a script
to a skillset.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, TypeAlias

import msgspec

from skillwing.services.errors import InvalidOptionError

DEFAULT_DELAY = 1.0
LONGEST = 1e9

Seconds: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=LONGEST)]
"""Seconds of robot time."""
Weight: TypeAlias = Annotated[float, msgspec.Meta(gt=0.0, le=LONGEST)]


class ScriptError(InvalidOptionError):
    """A mock script cannot be played. where: the script; problems: a sentence for each problem."""

    def __init__(self, where: str, problems: Sequence[str]) -> None:
        self.where = where
        self.problems = tuple(problems)
        count = "a problem" if len(self.problems) == 1 else f"{len(self.problems)} problems"
        lines = "".join(f"\n  {problem}" for problem in self.problems)
        super().__init__("script", f"{where} has {count}. Change what is said here; docs/mocks.md has it all.{lines}")


class InputDelay(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A delay in seconds from an input of the goal, such as `duration` or `plan.duration`; 0 for a negative one."""

    input: str


class MockRun(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Run of one goal.

    delay: robot time in seconds from the dispatch to the end, the two bounds of a random delay, or an input. output: of
    the result, by field; missing fields get a valid value. progress: feedback by field, each a value or a signal
    (`signals.py`). stop_delay: robot time from an interrupt to its confirmation. weight: relative probability among
    `Choices`.

    At most one of these fields determines the end. The default is the skill's first success; a skill without one runs
    until it is interrupted. result: a result's name; forever: until interrupted; invalid: refused as NV with this
    sentence; error: ERROR with this sentence; hang: the manager never answers again; crash: its process dies.
    """

    # Without the bounds of `Seconds`: msgspec 0.22 crashes where a bounded number may also be a tuple.
    delay: float | tuple[float, float] | InputDelay = DEFAULT_DELAY
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
    """Runs to draw from by weight, one for each goal, instead of a sequence."""

    __slots__ = ()


class When(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, rename={"ending": "with"}):
    """The trigger of a reaction: a resource that becomes a state, a skill that starts to run, or one that ends.

    ending: only these results (`ARRIVED`) or kinds of end (`RI`, `N_ARRIVED`); in a file it is called `with`.
    """

    resource: str | None = None
    becomes: str | None = None
    starts: str | None = None
    ends: str | None = None
    ending: str | tuple[str, ...] = ()


class Reaction(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """An action of the mocked world after an event, or once at its start if there is no `when`.

    after: delay in seconds. once: the first time only. trigger: extern transitions, as states by resource; fire:
    events; set: data from now on, as signals by name; end: results with which running goals end, by skill.
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

    skills: by skill, its runs in sequence, the last of which repeats, or `Choices`; other skills follow `MockRun()`.
    seed: of choices and random delays, by default 0. data: signals by name; other data keep a valid value. resources:
    initial states, reached by extern transitions.
    """

    skills: Mapping[str, Sequence[MockRun]] = {}
    seed: int | None = None
    data: dict[str, Any] = {}
    resources: dict[str, str] = {}
    reactions: tuple[Reaction, ...] = ()
