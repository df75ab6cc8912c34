"""Reminders of the end of certificates, and missions that do not start before it."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.services.access import key_store
from skillwing.services.access.certificate_watch import CertificateWatch, Reminder, RouterWatch
from skillwing.services.access.certificates import facts
from skillwing.services.access.key_store import KeyStore
from skillwing.services.access.policy import RobotAccess
from skillwing.services.errors import KeysError
from skillwing.services.processes.router import LOOPBACK_WITH_KEYS, run_router
from skillwing.services.wire.channel import Role

ROVER = RobotAccess("rover", "rover", {"skill/drive": Role.SKILL_MANAGER, "launcher": Role.LAUNCHER})
END = datetime(2027, 6, 1, tzinfo=UTC)
MINUTE, HOUR, DAY = timedelta(minutes=1), timedelta(hours=1), timedelta(days=1)


@given(start=st.floats(-35, 1), pause=st.floats(0.5, 600))
def test_reminders_come_daily_and_hourly_in_the_last_day(start: float, pause: float) -> None:
    """pause: minutes between two checks."""
    reminder = Reminder()
    now, given_at = END + start * DAY, list[datetime]()
    for _ in range(300):
        if reminder.due(END, now):
            given_at.append(now)
        now += pause * MINUTE
    checked = pause * MINUTE
    for before, after in pairwise(given_at):
        shortest = HOUR if END - after <= DAY else DAY
        longest = HOUR if END - before <= DAY else DAY
        assert shortest <= after - before < longest + checked
    assert all(END - each <= 30 * DAY for each in given_at)
    first_due = max(END + start * DAY, END - 30 * DAY)
    if first_due + checked < now:
        assert given_at
        assert given_at[0] < first_due + checked


def test_a_clock_that_is_set_back_silences_nothing() -> None:
    reminder = Reminder()
    assert reminder.due(END, END - DAY)
    assert reminder.due(END, END - 20 * DAY)
    assert not reminder.due(END, END - 20 * DAY + HOUR)


@pytest.fixture
def store(tmp_path: Path) -> KeyStore:
    made = KeyStore.init(tmp_path / "keys", [], days=20)
    made.add_robot(ROVER)
    return made


def end_of(store: KeyStore, process: str) -> datetime:
    return facts((store.folder / "robots" / "rover" / process / "certificate.pem").read_bytes()).expires


def test_a_mission_does_not_start_in_the_last_day_of_a_certificate_in_use(
    store: KeyStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    end = min(end_of(store, "skill.drive"), end_of(store, "launcher"))
    now = [end - 2 * DAY]
    watch = CertificateWatch(store.folder, "rover", ["skill/drive"], lambda: "./rover", lambda: now[0])
    command = f"`skillwing keys add-robot ./rover --robot-name rover --keys {store.folder}`"
    assert f"Renew it with {command}, then restart the router." in watch.reminder("first router")
    assert watch.reminder("first router") == ""
    assert watch.objection() == ""
    now[0] = end - DAY + MINUTE
    assert f"in use ends on {end:%Y-%m-%d at %H:%M} UTC." in watch.objection()
    monkeypatch.setattr(key_store, "utc_now", lambda: now[0])
    store.add_robot(ROVER)
    assert watch.remedy() == "It is renewed: restart the router, which uses it from then on."
    assert watch.objection(), "links of the old certificates end all the same"
    watch.reminder("")
    assert watch.objection(), "the router is away"
    watch.reminder("second router")
    assert watch.objection() == ""


def test_without_keys_nothing_ends() -> None:
    watch = CertificateWatch(None, "rover", ["skill/drive"])
    assert (watch.reminder("router"), watch.objection()) == ("", "")


def test_the_certificate_of_the_router_counts(store: KeyStore) -> None:
    other = KeyStore.init(store.folder.with_name("other"), [], days=2)
    for file in other.router_folder.iterdir():
        (store.router_folder / file.name).write_bytes(file.read_bytes())
    watch = CertificateWatch(store.folder, "rover", ["skill/drive"])
    assert "The certificate `router` in use ends" in watch.reminder("router")


def test_a_router_by_itself_reminds_of_the_end_of_its_certificate(
    store: KeyStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    end = facts((store.router_folder / "certificate.pem").read_bytes()).expires
    now = [end - 2 * DAY]
    watch = RouterWatch(store.folder, lambda: now[0])
    command = f"`skillwing keys add-robot ROBOT --keys {store.folder}`"
    text = f"The certificate `router` in use ends on {end:%Y-%m-%d at %H:%M} UTC. Then nobody reaches any robot here."
    assert watch.reminder() == f"{text} Renew it with {command}, then restart the router."
    assert watch.reminder() == ""
    now[0] = end + DAY
    monkeypatch.setattr(key_store, "utc_now", lambda: now[0])
    store.add_robot(ROVER)
    assert watch.reminder() == f"{text} It is renewed: restart the router, which uses it from then on."


def test_the_log_of_a_router_has_the_end_of_its_certificate(
    store: KeyStore, capsys: pytest.CaptureFixture[str]
) -> None:
    run_router(LOOPBACK_WITH_KEYS, store.folder, lambda *_: None, insecure=False, lasting=True)
    assert "The certificate `router` in use ends" in capsys.readouterr().err


def test_a_router_is_not_begun_in_the_last_day_and_is_begun_again(tmp_path: Path) -> None:
    """Robots that work need the router, whose supervisor starts it again."""
    folder = KeyStore.init(tmp_path / "keys", [], days=1).folder
    with pytest.raises(KeysError) as refused:
        run_router(LOOPBACK_WITH_KEYS, folder, lambda *_: None, insecure=False, lasting=True)
    said = str(refused.value)
    assert said.startswith("The certificate `router` is valid until")
    assert said.endswith(f"Renew it before a start: `skillwing keys add-robot ROBOT --keys {folder}`.")
    endpoints: list[str] = []
    run_router(LOOPBACK_WITH_KEYS, folder, lambda _, endpoint: endpoints.append(endpoint), insecure=False)
    assert endpoints
