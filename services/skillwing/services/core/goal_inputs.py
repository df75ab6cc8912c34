"""The inputs of a goal: those of its start, and new values for a running one."""

from __future__ import annotations

from collections.abc import Mapping

from skillwing.dsl.model import Skill
from skillwing.services.core.values import by_path, fit_fields, sendable_text
from skillwing.services.protocol import Ending, ProtocolError, Terminal, require_sendable


def first_inputs(skill: Skill, given: Mapping[str, object]) -> tuple[dict[str, object], Terminal | None]:
    """The inputs of a start, fitted, and its local outcome if they do not fit."""
    fitted, reasons = fitted_inputs(skill, given)
    if not reasons:
        return fitted, None
    reason = sendable_text(" ".join(reasons.values()))
    failing = tuple(path for path in reasons if path)
    return fitted, Terminal(ending=Ending.NOT_VALIDATED, reason=reason, failing=failing)


def fitted_inputs(skill: Skill, given: Mapping[str, object]) -> tuple[dict[str, object], dict[str, str]]:
    """The inputs of a goal, fitted, and a sentence for each path that does not fit; the path is empty for all."""
    fitted, problems = fit_fields(skill.inputs, given)
    # Fitted inputs may be longer than the start was: a whole number of one byte becomes a float of nine.
    if not problems and (problem := sending_problem(fitted)) is not None:
        return fitted, {"": f"The inputs of `{skill.name}` cannot be sent to the resource manager: {problem}."}
    return fitted, by_path(problems)


def sending_problem(values: Mapping[str, object]) -> str | None:
    """The reason why values of the right types cannot be sent: too many bytes, or a text that has no encoding."""
    if not values:
        return None
    try:
        require_sendable(values)
    except ProtocolError as error:
        return str(error)
    return None
