"""Checks that every core makes on a request first."""

from __future__ import annotations

from skillwing.dsl.model import Skillset, UnknownNameError
from skillwing.services.core.refusal import RefusedError
from skillwing.services.protocol import ErrorCode, ModifyGoal, StartGoal

LONGEST_GOAL_ID = 100


def check_goal_id(goal_id: str) -> None:
    """Refuse an id of a bad length: ids are remembered long after their goals, so they have to be short."""
    if not 0 < len(goal_id) <= LONGEST_GOAL_ID:
        raise RefusedError(
            ErrorCode.BAD_REQUEST,
            f"A goal id has 1 to {LONGEST_GOAL_ID} characters; this one has {len(goal_id)}.",
            help="Use a UUIDv7.",
        )


def check_schema(skillset: Skillset, schema: str) -> None:
    """Refuse a sender with another version of the skillset."""
    if schema != skillset.schema_hash:
        raise RefusedError(
            ErrorCode.SCHEMA_MISMATCH,
            f"The sender has version {schema[:16]} of `{skillset.name}`, this process has {skillset.schema_hash}.",
            help="Start both from the same .skillset file.",
        )


def check_timely(skillset: Skillset, skill: str, request: StartGoal | ModifyGoal, now: float) -> None:
    """Refuse a request of another version of the skillset, or after its deadline."""
    check_schema(skillset, request.schema)
    if request.deadline is not None and now > request.deadline:
        starts = isinstance(request, StartGoal)
        what, again = ("start", "Start again with another goal id") if starts else ("modification", "Ask again")
        late = f"The {what} of `{skill}` came {now - request.deadline:.1f} s after its deadline."
        raise RefusedError(ErrorCode.TOO_LATE, late, help=f"{again} if it is still wanted.")


def unknown_name(error: UnknownNameError) -> RefusedError:
    """The refusal for a name that the skillset does not have."""
    return RefusedError(ErrorCode.UNKNOWN_NAME, str(error), known=error.known)
