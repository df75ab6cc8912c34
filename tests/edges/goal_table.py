"""The table of a goal's states: state x event -> next state and action. It is derived by running the states.

`make edges` writes it into docs/semantics.md, with the diagram and a count of the edges that were taken.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

from skillwing.dsl import parse
from skillwing.services.core.events import TimePassed
from skillwing.services.core.goal_states import (
    Ask,
    Asking,
    AskingCancelled,
    Committing,
    Dispatching,
    Finished,
    Finishing,
    GivingBack,
    GoalState,
    Idle,
    Modifying,
    Reaction,
    Running,
    Stopping,
    Validating,
    ValidatingCancelled,
)
from skillwing.services.core.skill_actions import Hook
from skillwing.services.core.skill_events import (
    Accepted,
    Dispatched,
    Failed,
    GoalEvent,
    ModificationRequested,
    Raised,
    Rejected,
    RenewalAnswered,
    Reply,
    RetriesExhausted,
    StopConfirmed,
    StopRequested,
    Terminated,
    Validated,
)
from skillwing.services.core.verdicts import REVOKED_CODES
from skillwing.services.protocol import (
    Ended,
    Ending,
    EndKind,
    ErrorCode,
    ErrorReply,
    Granted,
    Lost,
    NotReady,
    RenewGoal,
    State,
    Terminal,
    Violated,
)

SKILL = parse(
    """
    skillset table {
        skill move {
            deadline=10.0
            effect { none {} }
            precondition { success none }
            interrupt { apply=none timeout=1.0 }
            result { DONE: apply=none }
        }
    }
    """
).skill("move")
WITHOUT_GRANT = (Validating, ValidatingCancelled, Asking, AskingCancelled, Committing)
WITH_GRANT = (Dispatching, Running, Modifying, Stopping, Finishing, GivingBack)
STATES = (Idle, *WITHOUT_GRANT, *WITH_GRANT, Finished)
TOKEN = 7
BEFORE, AFTER = 0.0, 20.0
"""Robot times before and after each deadline."""
LAST_SILENCE = 19
NEW_INPUTS = ModificationRequested("m", {}, "why")


class Edge(NamedTuple):
    """One cell of the table: an event that changes something in a state."""

    state: str
    event: str
    next: str
    action: str

    @property
    def text(self) -> str:
        return f"{self.state}: {self.event} -> {self.next}"


# --- names -----------------------------------------------------------------------------------------------------------


def state_name(state: GoalState) -> str:
    """Name of a state. A finished goal has its ending in it, one that finishes the kind of its end."""
    match state:
        case Finished(terminal=terminal):
            return f"Finished {terminal.ending}"
        case Committing(outcome=outcome):
            return f"Committing {outcome.ending}"
        case Finishing(how=how, forced=forced) if not isinstance(state, GivingBack):
            return f"Finishing {how}{', forced' if forced else ''}"
        case _:
            return type(state).__name__


def event_name(event: GoalEvent) -> str:
    """Name of an event, as a reader of the table understands it."""
    match event:
        case Reply(answer=answer):
            return f"reply: {_answer_name(answer)}"
        case RenewalAnswered(answer=answer):
            return f"renewal: {_answer_name(answer)}"
        case Violated():
            return "pushed: violated"
        case Lost():
            return "pushed: lost"
        case Validated(problem=problem):
            return "`validate` accepts" if problem is None else "`validate` refuses"
        case _:
            return _NAMES[type(event)]


_NAMES: dict[type, str] = {
    Accepted: "start",
    Rejected: "start of a goal that cannot run",
    StopRequested: "asked to stop",
    ModificationRequested: "new inputs",
    Dispatched: "`on_dispatch` returns",
    Raised: "a hook raises",
    Terminated: "`terminated`",
    StopConfirmed: "`interrupted`",
    Failed: "`failed`",
    RetriesExhausted: "ten silences",
    TimePassed: "deadline passes",
}


def _answer_name(answer: object) -> str:
    match answer:
        case None:
            return "none"
        case ErrorReply(code=code):
            return "goal is not held" if code in REVOKED_CODES else "refused"
        case Ended(terminal=Terminal()):
            return "outcome"
        case NotReady():
            return "not ready"
        case Granted() | Violated() | Lost() | Ended():
            return type(answer).__name__.lower()
        case _:
            raise AssertionError(answer)


_ACTIONS = {
    None: "",
    Hook.VALIDATE: "call `validate`",
    Hook.DISPATCH: "call `on_dispatch`",
    Hook.MODIFY: "call `on_modify`",
    Hook.INTERRUPT: "call `on_interrupt`",
    Hook.ENDED: "call `on_ended`",
}
_QUESTIONS = {"BeginGoal": "ask for the grant", "EndGoal": "ask for the end", "RecordOutcome": "ask for the commit"}


def edge_of(state: GoalState, event: GoalEvent, reaction: Reaction) -> Edge:
    """The edge that a reaction takes."""
    after, action, _ = reaction
    assert after.question is not None or action is not Ask.RESOURCES
    doing = _QUESTIONS[after.question.__name__] if after.question and action is Ask.RESOURCES else _ACTIONS[action]  # pyright: ignore[reportArgumentType]
    return Edge(type(state).__name__, _event_in(state, event, after), state_name(after), doing)


def _event_in(state: GoalState, event: GoalEvent, after: GoalState) -> str:
    """Name of an event, by what counts of it in a state."""
    if isinstance(event, RenewalAnswered) and isinstance(after, Stopping):
        return "20 renewals without an answer"
    name = event_name(event)
    return name.replace("outcome", "ended") if isinstance(state, WITH_GRANT) else name


# --- examples of everything ------------------------------------------------------------------------------------------


def example_states() -> Iterator[GoalState]:
    """An example of each state, and of each field of it that decides something."""
    yield Idle()
    yield Validating()
    yield ValidatingCancelled("why")
    yield Asking()
    yield AskingCancelled("why")
    for ending in (Ending.BUSY, Ending.NOT_VALIDATED, Ending.INTERRUPTED, Ending.ERROR):
        yield Committing(Terminal(ending=ending, reason="why"), State.VALIDATING)
    for silences in (0, 1, LAST_SILENCE):
        yield Dispatching(TOKEN, 10.0, silences)
        yield Running(TOKEN, 10.0, silences)
        yield Modifying(TOKEN, 10.0, silences, change=NEW_INPUTS)
    yield Stopping(TOKEN, 1.0, "why")
    for phase in (State.DISPATCHING, State.RUNNING):
        yield Finishing(TOKEN, EndKind.RESULT, "why", phase, "DONE")
        yield Finishing(TOKEN, EndKind.ERROR, "why", phase)
    yield Finishing(TOKEN, EndKind.INTERRUPT, "why", State.INTERRUPTING)
    yield Finishing(TOKEN, EndKind.INTERRUPT, "why", State.INTERRUPTING, forced=True)
    yield GivingBack(TOKEN, EndKind.INTERRUPT, "why", State.INTERRUPTING)
    yield Finished(Terminal(ending=Ending.BUSY, reason="why"))


def example_events() -> Iterator[GoalEvent]:
    """An example of each event, with each answer that the resource manager can give."""
    yield Accepted()
    for ending in (Ending.BUSY, Ending.NOT_VALIDATED, Ending.INTERRUPTED):
        yield Rejected(Terminal(ending=ending, reason="why"))
    yield from (StopRequested("why"), NEW_INPUTS)
    yield from (Validated("g"), Validated("g", "No."), Dispatched("g"), Raised("g", "progress", "ValueError"))
    yield from (Terminated("g", "DONE"), Terminated("g", "UNKNOWN"), StopConfirmed("g"), Failed("g", "why"))
    for answer in _answers():
        yield Reply(answer)
        yield RenewalAnswered(RenewGoal(goal_id="g", skill="move", token=TOKEN), answer)
    yield RenewalAnswered(RenewGoal(goal_id="g", skill="move", token=TOKEN), None)
    yield from (RetriesExhausted(), _violated(), _lost(), TimePassed())


def _answers() -> Iterator[Granted | NotReady | Violated | Lost | Ended | ErrorReply]:
    yield Granted(goal_id="g", token=TOKEN, step=1, record="r")
    yield NotReady(goal_id="g", failing={"free": "It is not."}, step=3, record="r")
    yield from (_violated(), _lost())
    yield from (_ended(held, how) for held in (True, False) for how in (*EndKind, None))
    for ending in (Ending.BUSY, Ending.NOT_VALIDATED, Ending.INTERRUPTED, Ending.ERROR):
        terminal = Terminal(ending=ending, reason="why")
        yield Ended(goal_id="g", held=False, reason="", step=1, record="r", terminal=terminal)
    yield ErrorReply(code=ErrorCode.STALE_TOKEN, message="Not yours.")
    yield ErrorReply(code=ErrorCode.BAD_REQUEST, message="No.")


def _ended(held: bool, how: EndKind | None) -> Ended:
    result = "DONE" if how is EndKind.RESULT else None
    return Ended(goal_id="g", held=held, reason="", step=1, record="r", how=how, result=result)


def _violated() -> Violated:
    return Violated(
        goal_id="g", skill="move", invariant="i", subject="s", reason="why", t=0.0, step=3, record="r", token=TOKEN
    )


def _lost() -> Lost:
    return Lost(goal_id="g", skill="move", reason="why", t=0.0, step=3, record="r", token=TOKEN)


def all_edges() -> tuple[Edge, ...]:
    """Every edge there is, in order of the states and events."""
    edges: dict[Edge, None] = {}
    for state, event, now in product(example_states(), example_events(), (BEFORE, AFTER)):
        reaction = state.on(event, SKILL, now)
        if reaction is not None:
            edges[edge_of(state, event, reaction)] = None
    order = [each.__name__ for each in STATES]
    return tuple(sorted(edges, key=lambda edge: order.index(edge.state)))


# --- as Markdown -----------------------------------------------------------------------------------------------------


def diagram() -> str:
    """The states and the ways between them, for Mermaid."""
    ways: dict[tuple[str, str], dict[str, None]] = {}
    for edge in all_edges():
        after = edge.next.partition(" ")[0]
        if edge.state != after:
            events = ways.setdefault((edge.state, after), {})
            events[edge.next.partition(" ")[2] if after == "Finished" else _short(edge.event)] = None
    lines = ["```mermaid", "stateDiagram-v2"]
    for title, name, states in (
        ("holds no grant", "WithoutGrant", WITHOUT_GRANT),
        ("holds a grant", "WithGrant", WITH_GRANT),
    ):
        lines += [f'    state "{title}" as {name} {{', *(f"        {each.__name__}" for each in states), "    }"]
    for (state, after), labels in ways.items():
        begin = "[*]" if state == "Idle" else state
        lines.append(f"    {begin} --> {after}: {', '.join(labels)}")
    return "\n".join([*lines, "    Finished --> [*]", "```"])


def _short(event: str) -> str:
    return event.replace("`", "").replace(": ", " ")


def table() -> str:
    """The edges as a table; events that lead to the same are in one row."""
    rows: dict[tuple[str, str, str], dict[str, None]] = {}
    for edge in all_edges():
        rows.setdefault((edge.state, edge.next, edge.action), {})[edge.event] = None
    merged: dict[tuple[str, tuple[str, ...], str], list[str]] = {}
    for (state, after, action), events in rows.items():
        merged.setdefault((state, tuple(events), action), []).append(after)
    lines = ["| state | event | next state | action |", "|---|---|---|---|"]
    for (state, events, action), afters in merged.items():
        lines.append(f"| {state} | {'; '.join(events)} | {_joined(afters)} | {action} |")
    return "\n".join(lines)


def _joined(states: list[str]) -> str:
    """`Finished S or N` for two names that begin alike."""
    head = states[0].partition(" ")[0]
    tails = [state.partition(" ")[2] for state in states]
    return f"{head} {' or '.join(tails)}".strip()


def page_text() -> str:
    """The diagram and the table, as they are in docs/semantics.md."""
    return f"{diagram()}\n\n{table()}"
