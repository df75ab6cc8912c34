"""What the words of the protocol mean: states, ends and refusals, in one sentence each."""

from __future__ import annotations

from skillwing.services.protocol import Ending, ErrorCode, State

STATES: dict[State, str] = {
    State.VALIDATING: "Inputs and preconditions are being judged. Nothing is held yet.",
    State.DISPATCHING: "Granted: the start effect has been applied, and the skill is being told to begin.",
    State.RUNNING: "The skill is at work.",
    State.INTERRUPTING: "The skill has been asked to stop. It holds what it holds until it has stopped.",
    State.TERMINATED: "Over; `terminal` says how.",
}

ENDINGS: dict[Ending, tuple[str, str]] = {
    Ending.NOT_VALIDATED: ("Not validated: an input is out of range, or the skill said no.", "`failing`: the inputs"),
    Ending.NOT_READY: ("Not ready: preconditions fail.", "`failing`: every one of them"),
    Ending.INVARIANT_VIOLATED: ("An invariant was violated.", "`invariant`, `subject`: the resource or datum"),
    Ending.SUCCEEDED: (
        "The skill ended with `result`, and everything held. Whether that is good news says `success`.",
        "`result`, `success`, `output`",
    ),
    Ending.NOT_HELD: ("The skill ended with `result`, but effect or postcondition did not hold.", "`result`, `output`"),
    Ending.INTERRUPTED: (
        "Interrupted: the skill confirmed that it has stopped, or the timeout enforced it.",
        "`forced`",
    ),
    Ending.BUSY: ("The skill runs another goal, which is left alone.", "`running_goal`"),
    Ending.ERROR: ("The skill's code raised or gave up, or the resource manager refused or was silent.", ""),
    Ending.LOST: (
        "The skill's manager died, hung or was cut off; what the goal held is free.",
        "`detected_by`",
    ),
}

REFUSALS: dict[ErrorCode, tuple[str, str]] = {
    ErrorCode.BAD_REQUEST: ("The payload is no such message, or what it says fits nowhere.", "Mend the sender."),
    ErrorCode.SCHEMA_MISMATCH: (
        "The sender was made for another version of the skillset.",
        "Make it anew from the skillset that runs.",
    ),
    ErrorCode.UNKNOWN_NAME: ("The skillset has no such name.", "Choose one of `known`."),
    ErrorCode.UNKNOWN_GOAL: (
        "Nobody knows this goal: it never arrived, or its manager has been started anew.",
        "After a start that was answered: count it as LOST.",
    ),
    ErrorCode.NOT_ALLOWED: ("The model or the present states forbid it.", "Look at the states; ask again later."),
    ErrorCode.STALE_TOKEN: ("The sender's grant was taken from it.", "Stop at once; the goal is somebody else's."),
    ErrorCode.REPLACED: (
        "Another process of the sender's name has attached after it.",
        "End, and say nothing of goals that were not granted: they are the other's to judge.",
    ),
    ErrorCode.TOO_LATE: ("The request came after its `deadline`.", "Start anew with another id if still wanted."),
    ErrorCode.UNAVAILABLE: ("It cannot be judged or written down just now; nothing has changed.", "Ask again."),
    ErrorCode.INTERNAL: (
        "The process failed on this request, and lives on. It may have been carried out.",
        "Ask again, or how the goal is; read its log.",
    ),
}
