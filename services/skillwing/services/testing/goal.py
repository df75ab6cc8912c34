"""A goal under test: its state, and assertions on its end."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Generic, NoReturn, Protocol, Self, TypeVar

import msgspec

from skillwing.dsl.model import Skill, UnknownNameError
from skillwing.services.client.interface import GoalHandle
from skillwing.services.protocol import Ending, State, Terminal

O = TypeVar("O")  # noqa: E741
F = TypeVar("F")

WITHIN = 60.0
"""Default waiting time of assertions, in seconds."""
ASSERTABLE = frozenset(Terminal.__struct_fields__) - {"ending"}


class GoalBench(Protocol):
    """The part of a bench that a goal uses."""

    def wait_for(self, goal: GoalHandle, within: float) -> bool: ...
    def interrupt(self, goal: GoalHandle) -> None: ...
    def modify(self, goal: GoalHandle, inputs: Mapping[str, Any]) -> str | None: ...
    def concerned(self, skill: Skill) -> str: ...
    def story(self, goal_id: str | None = None) -> str: ...
    def chain(self, record_id: str | None) -> list[str]: ...


class GoalUnderTest(Generic[O, F]):
    """A goal of a skill with outputs O and feedback F. Without a type, these are mappings."""

    def __init__(
        self,
        bench: GoalBench,
        handle: GoalHandle,
        model: Skill,
        inputs: Mapping[str, Any],
        outputs: type[O] | None,
        feedback: type[F] | None,
    ) -> None:
        self.handle = handle
        self.inputs = inputs
        self.feedback: list[F] = []
        """All feedback so far, the oldest first."""
        self._bench = bench
        self._model = model
        self._outputs = outputs
        self._feedback = feedback
        self._noted: Mapping[str, Any] | None = None
        handle.on_change(self._note)

    def __repr__(self) -> str:
        return repr(self.handle)

    @property
    def id(self) -> str:
        return self.handle.goal_id

    @property
    def state(self) -> State | None:
        """The state; None until the manager's first answer."""
        return self.handle.state

    @property
    def done(self) -> bool:
        return self.handle.done

    @property
    def terminal(self) -> Terminal:
        """The terminal answer. Fails the test if the goal has not ended."""
        if self.handle.terminal is None:
            self._fail(f"The goal of `{self._model.name}` is {self.state or 'SENT'}, not over.")
        return self.handle.terminal

    @property
    def output(self) -> O:
        """The output of the result. Fails the test if the goal has not ended or has none."""
        output = self.terminal.output
        if output is None:
            self._fail(f"The goal of `{self._model.name}` ended {self.terminal.label} without an output.")
        return _typed(output, self._outputs)

    @property
    def progress(self) -> F:
        """The latest feedback. Fails the test if there is none."""
        if not self.feedback:
            self._fail(f"The goal of `{self._model.name}` has not fed anything back.")
        return self.feedback[-1]

    @property
    def causes(self) -> list[str]:
        """The causes of the goal's present state, the root first: `["zed_status FAILED", "zed_depthmap RI"]`."""
        return self._bench.chain(self.handle.record)

    # --- doing -------------------------------------------------------------------------------------------------------

    def interrupt(self) -> Self:
        """Interrupt the goal and return at once: `goal.interrupt().assert_ended("IT")`."""
        self._bench.interrupt(self.handle)
        return self

    def modify(self, **inputs: Any) -> str | None:
        """Give the running goal new inputs. Returns the sentences of a refusal, None if they are accepted."""
        return self._bench.modify(self.handle, inputs)

    def wait(self, within: float = WITHIN) -> Terminal:
        """The terminal answer, of any kind. Fails the test if there is none in that time."""
        if not self._bench.wait_for(self.handle, within):
            self._fail(f"The goal of `{self._model.name}` has not ended within {within:g} s; it is {self.state}.")
        return self.terminal

    # --- asserting ---------------------------------------------------------------------------------------------------

    def assert_running(self) -> None:
        """Assert that the goal was granted and has neither ended nor been interrupted."""
        if self.state is not State.RUNNING:
            end = f": {self.terminal.label}. {self.terminal.reason}" if self.done else "."
            self._fail(f"The goal of `{self._model.name}` should be running; it is {self.state or 'SENT'}{end}")

    def assert_ended(self, label: str, *, within: float = WITHIN, **expected: Any) -> Terminal:
        """Wait for the end, and assert this label (`S_ARRIVED`, `N_ARRIVED`, `RI`, ...) and these attributes.

        expected: attributes of `Terminal`. `reason` has to be contained, in any letter case; `failing` is compared as a
        set. Of an `output`, a mapping compares the fields that it names, a struct all fields. Raises UnknownNameError
        for a label that no goal of this skill can have, TypeError for any other attribute.
        """
        self._check_label(label)
        if unknown := expected.keys() - ASSERTABLE:
            raise TypeError(f"A terminal answer has no {sorted(unknown)}; it has {sorted(ASSERTABLE)}.")
        terminal = self.wait(within)
        wrong = [] if terminal.label == label else [f"it ended {terminal.label}"]
        for name, value in expected.items():
            actual = getattr(terminal, name)
            if not _agrees(name, actual, value):
                wrong.append(f"`{name}` should be {value!r}, it is {actual!r}")
        if wrong:
            reason = f"\nIts reason: {terminal.reason}" if terminal.reason else ""
            self._fail(f"The goal of `{self._model.name}` should have ended {label}; {'; '.join(wrong)}.{reason}")
        return terminal

    # --- inside ------------------------------------------------------------------------------------------------------

    def _note(self, handle: GoalHandle) -> None:
        latest = handle.progress
        if latest is not None and latest is not self._noted:
            self._noted = latest
            self.feedback.append(_typed(latest, self._feedback))

    def _check_label(self, label: str) -> None:
        with_result = {Ending.SUCCEEDED, Ending.NOT_HELD}
        labels = [str(ending) for ending in Ending if ending not in with_result]
        labels += [f"{ending}_{result.name}" for ending in sorted(with_result) for result in self._model.results]
        if label not in labels:
            raise UnknownNameError(f"ending of {self._model.name}", label, labels)

    def _fail(self, sentence: str) -> NoReturn:
        inputs = ", ".join(f"{name}={value!r}" for name, value in self.inputs.items())
        told = [sentence, f"It was started as {self._model.name}({inputs})."]
        told += [f"Its conditions and effects are on: {on}."] if (on := self._bench.concerned(self._model)) else []
        told += [f"It has fed back last: {self.feedback[-1]!r}"] if self.feedback else []
        raise AssertionError("\n".join([*told, self._bench.story(self.id)]))


def _typed(value: Mapping[str, Any], kind: type[Any] | None) -> Any:
    return value if kind is None else msgspec.convert(value, kind)


def _agrees(name: str, actual: Any, expected: Any) -> bool:
    match name, expected:
        case "reason", str():
            return expected.casefold() in actual.casefold()
        case "failing", Iterable() if not isinstance(expected, str):
            return set(actual) == set(expected)
        case "output", Mapping():
            return actual is not None and all(actual.get(field) == value for field, value in expected.items())
        case "output", msgspec.Struct():
            return actual == msgspec.to_builtins(expected)
        case _:
            return actual == expected
