"""The one mission of a robot: which mission runs, which is being started on board, and the replies to its requests.

Pure: `LauncherNode` starts and watches the processes.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

from skillwing.services.core.bounded_dict import BoundedDict
from skillwing.services.core.refusal import RefusedError
from skillwing.services.protocol import ErrorCode, MissionPhase, MissionStatus, StartMission

OUTCOMES_REMEMBERED = 100
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")
"""Name of a mission, which is also the begin of a file's name on the robot. Names of robots have no other signs."""
FILE = re.compile(r"\.(py|xml)$")
MOST_OPTIONS = 1 << 16
"""Bytes of a mission's options and robots as JSON. They are part of a command line."""
WAIT = "Wait until it has ended, or abort it with `skillwing mission abort`."
ON_BOARD = "it runs on board"
LOOK = "Look at the logs of the run, on the robot."


Outcome = MissionStatus | RefusedError
"""Reply to a request."""


class MissionSlot:
    """Place of a robot's only mission. status: the latest one of any mission; None before the first.

    While a mission is on board, statuses of others are not taken: one on the ground may have begun at the same moment.
    """

    def __init__(self) -> None:
        self.status: MissionStatus | None = None
        self._own: StartMission | None = None
        """The request whose mission has a process."""
        self._begun = False
        """True once that mission has published a status."""
        self._before: MissionStatus | None = None
        """Status of the mission before that one."""
        self._present = False
        self._outcomes: BoundedDict[str, Outcome] = BoundedDict(OUTCOMES_REMEMBERED)
        self._latest: BoundedDict[str, MissionStatus] = BoundedDict(OUTCOMES_REMEMBERED)
        """Latest statuses of missions on board, by request."""

    def request(self, request: StartMission, t: float, objection: RefusedError | None = None) -> MissionStatus | None:
        """Reply to a request at robot time `t`; None if its mission has to be started now.

        objection: against the start of any mission.
        Raises RefusedError for a mission that cannot run now, with `UNAVAILABLE` for one that is being started.
        """
        known = self._outcomes.get(request.request_id)
        if isinstance(known, RefusedError):
            raise known
        if known is not None:
            return known
        if self._own is not None and self._own.request_id == request.request_id:
            raise being_started(request)
        _check(request)
        if self._present or self._own is not None:
            raise RefusedError(ErrorCode.NOT_ALLOWED, f"{self._name} runs here already.", help=WAIT)
        if objection is not None:
            raise objection
        self._own, self._begun, self._before = request, False, self.status
        self.status = MissionStatus(
            mission=request.mission, phase=MissionPhase.IDLE, t=t, text=ON_BOARD, request_id=request.request_id
        )
        return None

    def latest(self, request_id: str = "") -> MissionStatus:
        """The latest status, or that of the mission of a request. Raises RefusedError without one."""
        if not request_id and self.status is not None:
            return self.status
        if request_id and (found := self._latest.get(request_id)) is not None:
            return found
        if not request_id:
            text, help_ = "No mission has run here yet.", "Start one with `skillwing mission run`."
        else:
            text = "This launcher does not know that mission."
            help_ = "A launcher that was started again does not: the mission ended with the one before."
        raise RefusedError(ErrorCode.NOT_ALLOWED, text, help=help_)

    def on_board(self) -> MissionStatus:
        """The latest status of the mission whose process the launcher runs. Raises RefusedError without one."""
        if self._own is None or self.status is None:
            raise RefusedError(ErrorCode.NOT_ALLOWED, "No mission runs on board here.", help="It may run elsewhere.")
        return self.status

    def appeared(self) -> None:
        """Note the alive token of a mission, on board or on the ground."""
        self._present = True

    def vanished(self) -> None:
        """Note that no mission holds its alive token."""
        self._present = False

    def note(self, status: MissionStatus) -> None:
        """Note a status of a mission. The first one of the mission on board answers its request."""
        own = self._own
        if own is not None and status.request_id != own.request_id:
            return
        if own is not None and not self._begun and self.status is not None:
            self._begun = True
            self._outcomes[own.request_id] = self.status
        self._set(status)

    @property
    def ends_unheard(self) -> bool:
        """True if the mission on board has not published its end."""
        return self._own is not None and (self.status is None or not self.status.phase.over)

    def exited(self, sentence: str, lines: Sequence[str], *, does_not_fit: bool = False) -> bool:
        """Note the end of the mission's process. Returns True if it did not get to its begin: the request is refused.

        sentence: how it ended, empty if `lines` say it. lines: what it logged, such as its problems. does_not_fit: the
        process has refused its options.
        """
        own, self._own = self._own, None
        if own is None or self._begun:
            return False
        text = "\n".join([f"Mission `{own.mission}` did not start. {sentence}".rstrip(), *lines])
        code = ErrorCode.BAD_REQUEST if does_not_fit else ErrorCode.NOT_ALLOWED
        self._outcomes[own.request_id] = RefusedError(code, text, help=LOOK if sentence else "")
        self.status = self._before
        return True

    def cut_short(self, sentence: str, t: float) -> MissionStatus | None:
        """The last status of a mission whose process died before its end; None if it had ended, or never begun."""
        status = self.status
        if status is None or status.phase.over:
            return None
        return self._set(
            MissionStatus(
                mission=status.mission, phase=MissionPhase.ABORTED, t=t, text=sentence, request_id=status.request_id
            )
        )

    def _set(self, status: MissionStatus) -> MissionStatus:
        self.status = status
        if status.request_id:
            self._latest[status.request_id] = status
        return status

    @property
    def _name(self) -> str:
        if self._own is not None:
            return f"Mission {self._own.mission}"
        running = self.status is not None and not self.status.phase.over
        return f"Mission {self.status.mission}" if self.status is not None and running else "A mission"


def being_started(request: StartMission) -> RefusedError:
    """The refusal of a request whose mission's process is starting."""
    return RefusedError(ErrorCode.UNAVAILABLE, f"Mission `{request.mission}` is being started.", help="Ask again.")


def _check(request: StartMission) -> None:
    """Refuse a request that no robot could carry out."""
    if FILE.search(request.mission) or NAME.fullmatch(request.mission) is None:
        raise RefusedError(
            ErrorCode.BAD_REQUEST,
            f"`{request.mission}` is no name of a mission.",
            help="Install a mission in Python on the robot, and give its name. Send a tree file as text.",
        )
    if wrong := [robot for robot in request.robots.values() if NAME.fullmatch(robot) is None]:
        text = f"`{wrong[0]}` is no name of a robot."
        raise RefusedError(ErrorCode.BAD_REQUEST, text, help="Give names as of `up --robot-name`.")
    try:
        too_long = len(json.dumps([request.options, request.robots])) > MOST_OPTIONS
    except (TypeError, ValueError):
        text = f"The options of `{request.mission}` cannot be written as JSON."
        raise RefusedError(ErrorCode.BAD_REQUEST, text, help="Give texts, numbers and lists.") from None
    if too_long:
        text = f"The options of `{request.mission}` have more than {MOST_OPTIONS} bytes."
        raise RefusedError(ErrorCode.BAD_REQUEST, text, help="Put them into the mission.")
