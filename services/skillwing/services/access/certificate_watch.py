"""Watch over the certificates of a running system: reminders before they end, and a reason against long work.

The router ends links whose certificate has expired. All links of a robot are made at the start of its router, so they
end together. A renewed certificate counts from the next start of the router on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from datetime import datetime, timedelta
from pathlib import Path

from skillwing.services.access.certificate_facts import CertificateFacts, utc_now
from skillwing.services.access.identity_files import (
    NEEDED,
    add_robot_command,
    renewal_command,
    robot_certificates,
    unknown_table,
)
from skillwing.services.access.key_store import RENEWAL, ROUTER, read_facts
from skillwing.services.errors import KeysError

HOUR, DAY = timedelta(hours=1), timedelta(days=1)
RENEW = "Renew it with {command}, then restart the router."
RENEWED = "It is renewed: restart the router, which uses it from then on."


class Reminder:
    """The rule for reminders of an end: once a day in the last 30 days, once an hour in the last day and after it."""

    def __init__(self) -> None:
        self._said: datetime | None = None

    def due(self, end: datetime, now: datetime) -> bool:
        """True if it is time for a reminder, which then counts as given."""
        pause = HOUR if end - now <= DAY else DAY
        # A clock that was set back must not silence it.
        recent = self._said is not None and abs(now - self._said) < pause
        if end - now > RENEWAL or recent:
            return False
        self._said = now
        return True


class CertificateWatch:
    """The watch over the certificates of a robot's processes and its router.

    folder: of keys, None without any. processes: those with a certificate, without the launcher. table: as of
    `require_certificates`. now: UTC.
    """

    def __init__(
        self,
        folder: Path | None,
        robot: str,
        processes: Iterable[str],
        table: Callable[[], str] = unknown_table,
        now: Callable[[], datetime] = utc_now,
    ) -> None:
        self._folder, self._robot, self._processes = folder, robot, tuple(processes)
        self._table, self._now = table, now
        self._router = ""
        self._first: CertificateFacts | None = self._read()
        """The certificate in use that ends first."""
        self._reminder = Reminder()

    def reminder(self, router: str) -> str:
        """A sentence if it is time for one, else empty. router: id of the present router, empty while it is away."""
        if router and router != self._router:
            self._router, self._first = router, self._read() or self._first
        if self._first is None or not self._reminder.due(self._first.expires, self._now()):
            return ""
        return f"{_end(self._first)} Then nobody reaches `{self._robot}`. {self.remedy()}"

    def objection(self) -> str:
        """The reason against the start of a mission, which may last long; empty without one."""
        if self._first is None or self._first.expires - self._now() >= NEEDED:
            return ""
        return f"{_end(self._first)} It might end during the mission, and nobody would reach `{self._robot}`."

    def remedy(self) -> str:
        """The next step against such an end."""
        renewed = self._read()
        if renewed is not None and self._first is not None and renewed.expires > self._first.expires:
            return RENEWED
        if self._folder is None:
            return ""
        return RENEW.format(command=add_robot_command(self._folder, self._robot, self._table))

    def _read(self) -> CertificateFacts | None:
        if self._folder is None:
            return None
        try:
            found = robot_certificates(self._folder, self._robot, self._processes)
        except KeysError:  # files that are being replaced; those in use stay as they are
            return None
        return min(found, key=lambda each: each.expires)


class RouterWatch:
    """The watch over the certificate of a router, which reads it at its start. folder: of its site. now: UTC.

    Raises KeysError without a certificate.
    """

    def __init__(self, folder: Path, now: Callable[[], datetime] = utc_now) -> None:
        self._folder, self._now = folder, now
        self._in_use = read_facts(folder / ROUTER)
        self._reminder = Reminder()

    def reminder(self) -> str:
        """A sentence if it is time for one, else empty."""
        if not self._reminder.due(self._in_use.expires, self._now()):
            return ""
        return f"{_end(self._in_use)} Then nobody reaches any robot here. {self._remedy()}"

    def _remedy(self) -> str:
        with suppress(KeysError):  # files that are being replaced
            if read_facts(self._folder / ROUTER).expires > self._in_use.expires:
                return RENEWED
        return RENEW.format(command=renewal_command(self._folder))


def _end(certificate: CertificateFacts) -> str:
    return f"The certificate `{certificate.name}` in use ends on {certificate.expires:%Y-%m-%d at %H:%M} UTC."
