"""Registration of a manager at the resource manager."""

from __future__ import annotations

import logging
from collections.abc import Callable

from skillwing.services.bus import Answered, Bus, Handle, Refused
from skillwing.services.client.retry import ask_until_answered
from skillwing.services.errors import WrongSkillsetError
from skillwing.services.protocol import (
    AttachManager,
    ErrorCode,
    ErrorReply,
    Keys,
    encode,
)

REGISTRATION_PERIOD = 5.0
"""Wall time in seconds between two registrations of an idle manager."""

log = logging.getLogger(__name__)


class Registration:
    """Attaches a manager to the resource manager, and repeats that from time to time.

    If another process of the name has attached since, the reply says so. Then on_replaced is called once with that
    refusal, and the questions end, as they do with `give_up`. If the resource manager has another version of the
    skillset, a WrongSkillsetError ends the process: it would never get a grant.
    """

    def __init__(
        self,
        bus: Bus,
        keys: Keys,
        attach: AttachManager,
        on_replaced: Callable[[ErrorReply], None],
    ) -> None:
        self._bus = bus
        self._key = keys.resource_attach
        self._manager = attach.manager
        self._question = encode(attach)
        self._on_replaced = on_replaced
        self._refused = False
        self._timer: Handle | None = None
        self._over = False

    def ask(self) -> None:
        """Attach now. Idempotent for the latest process of a name."""
        if not self._over:
            ask_until_answered(self._bus, self._key, self._question, self._on_answer, keep_retrying=self._goes_on)

    def give_up(self) -> None:
        """End the registration; the next process of the name takes over."""
        self._over = True
        if self._timer is not None:
            self._timer.cancel()

    def _goes_on(self, silences: int) -> bool:
        del silences
        return not self._over

    def _on_answer(self, answer: Answered | Refused) -> None:
        if self._over:
            return
        match answer:
            case Answered():
                self._refused = False
                self._ask_after(REGISTRATION_PERIOD)
            case Refused(error) if error.code is ErrorCode.REPLACED:
                self.give_up()
                self._on_replaced(error)
            case Refused(error) if error.code is ErrorCode.SCHEMA_MISMATCH:
                raise WrongSkillsetError(f"{error.message} {error.help}".strip())
            case Refused(error):
                if not self._refused:
                    log.warning("the resource manager has not accepted %s yet: %s", self._manager, error.message)
                self._refused = True
                self._ask_after(REGISTRATION_PERIOD)

    def _ask_after(self, seconds: float) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._bus.after(seconds, self.ask, wall=True)
