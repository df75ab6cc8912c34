"""The folder of a site's keys."""

from __future__ import annotations

import os
import re
import ssl
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import timedelta
from errno import ENOSPC
from pathlib import Path
from typing import Any

import pytest
from cryptography.hazmat.primitives.serialization import (
    BestAvailableEncryption,
    Encoding,
    PrivateFormat,
    load_pem_private_key,
)
from typer.testing import CliRunner

from skillwing.services.access import key_store
from skillwing.services.access.certificate_facts import utc_now
from skillwing.services.access.certificates import facts, fits, issue, new_authority
from skillwing.services.access.identity_files import (
    person_identity,
    process_identity,
    require_certificates,
    require_router_certificate,
)
from skillwing.services.access.key_store import KeyStore
from skillwing.services.access.policy import RobotAccess
from skillwing.services.access.robots import table_words
from skillwing.services.access.router_keys import read_router_keys
from skillwing.services.errors import InvalidOptionError, KeysError, SkillwingError
from skillwing.services.robot import Robot, find_robot
from skillwing.services.terminal.cli import app
from skillwing.services.wire.channel import Role

ROVER = RobotAccess("rover", "rover", {"skill/drive": Role.SKILL_MANAGER, "launcher": Role.LAUNCHER})
TIMEOUT = 30.0
FILES = ("certificate.pem", "key.pem", "authority.pem")
LOOK = 0.5
"""Seconds that a command has to look into a folder in which another one works. With the lock, it looks later."""


@pytest.fixture
def store(tmp_path: Path) -> KeyStore:
    made = KeyStore.init(tmp_path / "keys", ["10.0.0.5", "robot.local"], days=60)
    made.add_robot(ROVER)
    return made


def test_nobody_else_can_read_the_files(store: KeyStore) -> None:
    store.add_person("alice", Role.CLIENT)
    files = [path for path in store.folder.rglob("*") if path.is_file()]
    assert len(files) == 1 + 2 + 4 * 3
    assert {path.stat().st_mode & 0o777 for path in files} == {0o600}
    assert store.folder.stat().st_mode & 0o777 == 0o700


def test_a_folder_with_keys_is_not_overwritten(store: KeyStore) -> None:
    with pytest.raises(KeysError, match="holds keys already"):
        KeyStore.init(store.folder, [])


def test_the_site_is_what_was_added(store: KeyStore) -> None:
    store.add_person("alice", Role.CLIENT)
    site = store.site()
    assert site.robots == (ROVER,)
    assert site.people == {"alice": Role.CLIENT}
    store.remove("alice")
    assert store.site().people == {}
    assert not (store.folder / "people" / "alice").exists()
    with pytest.raises(KeysError, match=r"`alice` is no person and no robot in .* Known: rover\.$"):
        store.remove("alice")
    with pytest.raises(KeysError, match=r"Remove `rover` as a whole\.$"):
        store.remove("rover.launcher")
    with pytest.raises(InvalidOptionError, match="`router` is the name of the router"):
        store.add_person("router", Role.CLIENT)


def test_a_removed_name_is_never_given_again(store: KeyStore) -> None:
    """The policy knows names only: the old certificate would be let in with the new one."""
    store.add_person("alice", Role.CLIENT)
    store.remove("alice")
    store.remove("rover")
    before = contents(store)
    with pytest.raises(InvalidOptionError, match=r"`alice` was removed, .* Choose another name, such as `alice2`"):
        store.add_person("alice", Role.CLIENT)
    with pytest.raises(InvalidOptionError, match=r"`rover` was removed, .* such as --robot-name rover2"):
        store.add_robot(ROVER)
    with pytest.raises(InvalidOptionError, match="was removed"):
        KeyStore.prepare(store.folder, [], [], ["alice"])
    assert contents(store) == before
    store.add_person("alice2", Role.CLIENT)
    assert store.site().people == {"alice2": Role.CLIENT}


def test_a_robot_and_a_person_have_different_names(store: KeyStore) -> None:
    store.add_person("alice", Role.CLIENT)
    with pytest.raises(InvalidOptionError, match=r"`rover` is a robot here\. Choose another name, such as `rover2`"):
        store.add_person("rover", Role.VIEWER)
    with pytest.raises(InvalidOptionError, match="`alice` is a person here"):
        store.add_robot(replace(ROVER, name="alice"))
    store.add_robot(ROVER)
    assert store.site().people == {"alice": Role.CLIENT}


def test_the_router_serves_its_hosts_and_people_serve_nobody(store: KeyStore) -> None:
    router = facts((store.router_folder / "certificate.pem").read_bytes())
    assert set(router.hosts) == {"10.0.0.5", "robot.local", "localhost", "127.0.0.1", "::1"}
    alice = facts((store.add_person("alice", Role.VIEWER) / "certificate.pem").read_bytes())
    assert (alice.name, alice.role, alice.hosts) == ("alice", "viewer", ())
    left = alice.expires - utc_now()
    assert timedelta(days=59) < left <= timedelta(days=60)


def test_certificates_that_end_soon_are_renewed(tmp_path: Path) -> None:
    store = KeyStore.init(tmp_path / "keys", [], days=20)
    store.add_robot(ROVER)
    before = {holder.name: (holder.folder / "certificate.pem").read_bytes() for holder in store.holders()}
    store.add_robot(ROVER)
    after = {holder.name: (holder.folder / "certificate.pem").read_bytes() for holder in store.holders()}
    assert before.keys() == after.keys() == {"router", "rover.skill.drive", "rover.launcher"}
    assert all(before[name] != after[name] for name in before)


def test_keys_of_a_new_process_are_added_and_the_others_stay(store: KeyStore) -> None:
    before = (store.folder / "robots" / "rover" / "skill.drive" / "key.pem").read_bytes()
    with pytest.raises(KeysError, match="add-robot ROBOT --robot-name rover --keys"):
        require_certificates(store.folder, "rover", ["skill/drive", "skill/lift"])
    more = {**ROVER.processes, "skill/lift": Role.SKILL_MANAGER}
    store.add_robot(RobotAccess("rover", "rover", more))
    require_certificates(store.folder, "rover", ["skill/drive", "skill/lift"])
    assert (store.folder / "robots" / "rover" / "skill.drive" / "key.pem").read_bytes() == before


def contents(store: KeyStore) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in store.folder.rglob("*") if path.is_file()}


def test_a_prepared_folder_has_what_was_named_and_is_left_alone_the_next_time(tmp_path: Path) -> None:
    store = KeyStore.prepare(tmp_path / "keys", ["router"], [ROVER], ["cli"])
    assert store.site().robots == (ROVER,)
    assert store.site().people == {"cli": Role.OPERATOR}
    store.add_person("alice", Role.VIEWER)
    before = contents(store)
    KeyStore.prepare(store.folder, ["router"], [ROVER], ["cli"])
    assert contents(store) == before


def test_a_prepared_folder_leaves_a_person_the_role_that_it_has(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = KeyStore.prepare(tmp_path / "keys", [], [ROVER], ["cli"])
    store.add_person("cli", Role.VIEWER)
    before = contents(store)
    KeyStore.prepare(store.folder, [], [ROVER], ["cli"])
    assert contents(store) == before
    monkeypatch.setattr(key_store, "utc_now", lambda: utc_now() + timedelta(days=366))
    KeyStore.prepare(store.folder, [], [ROVER], ["cli"])
    assert store.site().people == {"cli": Role.VIEWER}
    assert facts((store.folder / "people" / "cli" / "certificate.pem").read_bytes()).role == "viewer"


def test_a_prepared_folder_takes_in_a_new_host_and_changes_the_router_alone(tmp_path: Path) -> None:
    store = KeyStore.prepare(tmp_path / "keys", ["router"], [ROVER], ["cli"])
    before = contents(store)
    KeyStore.prepare(store.folder, ["router", "10.0.0.5"], [ROVER], ["cli"])
    assert {"router", "10.0.0.5"} <= set(facts((store.router_folder / "certificate.pem").read_bytes()).hosts)
    after = contents(store)
    changed = {path.relative_to(store.folder) for path in after if after[path] != before[path]}
    assert changed == {Path("names.json"), Path("router/certificate.pem"), Path("router/key.pem")}


def test_a_prepared_folder_is_renewed_at_the_next_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = KeyStore.prepare(tmp_path / "keys", [], [ROVER], ["cli"])
    later = utc_now() + timedelta(days=366)
    monkeypatch.setattr(key_store, "utc_now", lambda: later)
    assert {holder.expires is not None and holder.expires < later for holder in store.holders()} == {True}
    KeyStore.prepare(store.folder, [], [ROVER], ["cli"])
    ends = [holder.expires for holder in store.holders()]
    assert {end is not None and end - later > timedelta(days=364) for end in ends} == {True}


def test_keys_of_a_lost_authority_are_made_again(tmp_path: Path) -> None:
    """Each folder is a volume in containers, and one of them can be removed."""
    store = KeyStore.prepare(tmp_path / "keys", [], [ROVER], ["cli"])
    (store.folder / "names.json").unlink()
    KeyStore.prepare(store.folder, [], [ROVER], ["cli"])
    authority = (store.folder / "authority" / "certificate.pem").read_bytes()
    assert {(holder.folder / "authority.pem").read_bytes() for holder in store.holders()} == {authority}


def test_a_robot_does_not_start_with_keys_that_end_today(tmp_path: Path) -> None:
    store = KeyStore.init(tmp_path / "keys", [], days=1)
    store.add_robot(ROVER)
    with pytest.raises(KeysError, match=r"valid until .* Renew it before a start"):
        require_certificates(store.folder, "rover", ["skill/drive"])


def test_the_remedy_for_a_missing_certificate_is_a_command_that_makes_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    table = replace(find_robot("m600"), name="third")
    store = KeyStore.init(Path("keys"), [])
    with pytest.raises(KeysError) as refused:
        require_certificates(store.folder, "third", ["skill/land"], lambda: table_words(table))
    remedy = str(refused.value).partition("`skillwing ")[2].partition("`")[0]
    assert remedy == "keys add-robot m600 --robot-name third --keys keys"
    done = CliRunner().invoke(app, remedy.split())
    assert done.exit_code == 0, done.output
    require_certificates(store.folder, "third", ["skill/land"], lambda: table_words(table))


def test_the_table_of_a_robot_is_found_by_its_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert table_words(find_robot("m600")) == "m600"
    yard = Path(__file__).parents[3] / "examples" / "yard"
    monkeypatch.chdir(yard.parent)
    assert table_words(find_robot("./yard")) == "./yard"
    skillset = tmp_path / "day.skillset"
    mocked = Robot(name="a1", skillset=skillset, hooks={}, clock="wall")
    assert table_words(mocked) == f"a1 --skillset {skillset}"


@pytest.mark.parametrize("name", ["", "a/b", "a.b", "m600.skill.land", "a~b", "*", "router", "é", "a" * 41])
def test_a_name_that_could_be_mistaken_is_refused(store: KeyStore, name: str) -> None:
    with pytest.raises(InvalidOptionError):
        store.add_person(name, Role.CLIENT)


def test_a_person_has_no_role_of_a_process(store: KeyStore) -> None:
    with pytest.raises(InvalidOptionError, match="viewer, client or operator"):
        store.add_person("alice", Role.RESOURCE_MANAGER)


def test_a_name_that_is_too_long_for_a_certificate_is_refused() -> None:
    with pytest.raises(SkillwingError, match="64"):
        issue(new_authority(1, utc_now()), "n" * 65, "", 1, utc_now())


def test_identities_are_found_in_their_folders(store: KeyStore, monkeypatch: pytest.MonkeyPatch) -> None:
    own = store.folder / "robots" / "rover" / "skill.drive"
    for folder in (store.folder, store.folder / "robots" / "rover", own):
        assert process_identity(folder, "rover", "skill/drive").name == "rover.skill.drive"
    monkeypatch.delenv("SKILLWING_KEYS", raising=False)
    assert person_identity("tcp/10.0.0.5:7447") is None
    with pytest.raises(KeysError, match="SKILLWING_KEYS=FOLDER"):
        person_identity("tls/10.0.0.5:7447")
    monkeypatch.setenv("SKILLWING_KEYS", str(store.folder / "missing"))
    with pytest.raises(KeysError, match="missing in SKILLWING_KEYS is no folder"):
        person_identity("tls/10.0.0.5:7447")
    monkeypatch.setenv("SKILLWING_KEYS", str(store.folder))
    with pytest.raises(KeysError, match="folder of one person"):
        person_identity("tls/10.0.0.5:7447")
    alice = store.add_person("alice", Role.VIEWER)
    monkeypatch.setenv("SKILLWING_KEYS", str(alice))
    found = person_identity("tls/10.0.0.5:7447")
    assert found is not None
    assert found.name == "alice"
    assert found.refusal("rover/skill/drive/start") is not None


def test_swapped_keys_of_processes_are_made_again(store: KeyStore) -> None:
    launcher, drive = (store.folder / "robots" / "rover" / name for name in ("launcher", "skill.drive"))
    for file in FILES:
        (drive / file).write_bytes((launcher / file).read_bytes())
    with pytest.raises(KeysError, match=r"needs `rover\.skill\.drive`\. Make it again: `skillwing keys"):
        require_certificates(store.folder, "rover", ["skill/drive"])
    store.add_robot(ROVER)
    require_certificates(store.folder, "rover", ["skill/drive"])


def test_the_folder_of_the_router_is_nobody_s(store: KeyStore, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SKILLWING_KEYS", str(store.router_folder))
    with pytest.raises(KeysError, match=r"has the certificate of the router\. Name the folder of one person"):
        person_identity("tls/10.0.0.5:7447")


@pytest.mark.parametrize("place", ["people/alice", "robots/second", "robots/second/launcher", "router"])
def test_the_certificate_of_somebody_else_is_refused_with_its_name(store: KeyStore, place: str) -> None:
    store.add_robot(replace(ROVER, name="second"))
    store.add_person("alice", Role.OPERATOR)
    name = place.partition("/")[2].removesuffix("/launcher") or place
    other = f"{name}.launcher" if name == "second" else name
    with pytest.raises(KeysError, match=f"is that of `{other}`, and `launcher` of `rover` needs `rover.launcher`"):
        process_identity(store.folder / place, "rover", "launcher")
    with pytest.raises(KeysError, match=r"Give the folder of the site, DIR, or that of the robot, DIR/robots/rover\."):
        require_certificates(store.folder / place, "rover", [])


@pytest.mark.parametrize(
    ("file", "content", "objection"),
    [
        ("certificate.pem", "cut", "is no certificate that can be read"),
        ("key.pem", "cut", "is no key that can be read"),
        ("key.pem", "another", "is the key of another certificate"),
        ("key.pem", "locked", "is no key that can be read"),
        ("authority.pem", "cut", "is no certificate that can be read"),
    ],
)
def test_a_damaged_file_is_named_before_anybody_is_asked(
    store: KeyStore, monkeypatch: pytest.MonkeyPatch, file: str, content: str, objection: str
) -> None:
    """A copy may break off. Zenoh would report an address at which it cannot connect."""
    alice, bob = (store.add_person(name, Role.CLIENT) for name in ("alice", "bob"))
    monkeypatch.setenv("SKILLWING_KEYS", str(alice))
    whole = (alice / file).read_bytes()
    key = load_pem_private_key((alice / "key.pem").read_bytes(), None)
    locked = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, BestAvailableEncryption(b"secret"))
    contents = {"cut": whole[: len(whole) // 2], "another": (bob / file).read_bytes(), "locked": locked}
    (alice / file).write_bytes(contents[content])
    text = f"{alice / file} {objection}. Ask for a new folder of keys."
    with pytest.raises(KeysError, match=f"^{re.escape(text)}$"):
        person_identity("tls/10.0.0.5:7447")
    (store.router_folder / file).write_bytes(contents[content])
    with pytest.raises(KeysError, match=f"{file} {objection}. Make it again: `skillwing keys add-robot"):
        require_router_certificate(store.folder)
    store.add_robot(ROVER)
    require_router_certificate(store.folder)


@pytest.mark.parametrize("file", FILES)
@pytest.mark.parametrize("damage", ["missing", "empty"])
def test_a_folder_that_is_not_whole_names_the_file_and_the_remedy(
    store: KeyStore, monkeypatch: pytest.MonkeyPatch, file: str, damage: str
) -> None:
    alice = store.add_person("alice", Role.CLIENT)
    monkeypatch.setenv("SKILLWING_KEYS", str(alice))
    own = store.folder / "robots" / "rover" / "launcher"
    for folder in (alice, own, store.router_folder):
        (folder / file).unlink()
        if damage == "empty":
            (folder / file).touch()
    again = f"Make it again: `skillwing keys add-robot ROBOT --keys {store.folder}`."
    reason = "The file is empty" if damage == "empty" else "No such file or directory"
    with pytest.raises(KeysError, match=re.escape(f"{store.router_folder / file} cannot be read: {reason}. {again}")):
        read_router_keys(store.folder)
    if damage == "missing" and file == "certificate.pem":
        return  # without a certificate, there is no folder of keys at all
    with pytest.raises(KeysError, match=re.escape(f"{alice / file} cannot be read: {reason}. Ask for a new folder")):
        person_identity("tls/10.0.0.5:7447")
    with pytest.raises(KeysError, match=rf"{file} cannot be read: .* Make it again: `skillwing keys add-robot ROBOT "):
        process_identity(store.folder, "rover", "launcher")
    with pytest.raises(KeysError, match=rf"{file} cannot be read: .* Ask for a new folder of keys\."):
        process_identity(store.folder / "robots" / "rover", "rover", "launcher")


def test_python_accepts_the_chain(store: KeyStore) -> None:
    context = ssl.create_default_context(cafile=str(store.router_folder / "authority.pem"))
    context.load_cert_chain(store.router_folder / "certificate.pem", store.router_folder / "key.pem")
    assert context.cert_store_stats()["x509_ca"] == 1


def test_a_damaged_folder_is_one_sentence(store: KeyStore) -> None:
    (store.folder / "names.json").write_text("{", encoding="utf-8")
    with pytest.raises(KeysError, match="cannot be read"):
        store.site()


@pytest.mark.parametrize("host", ["müller.local", "192.168.1.7:7447", "tls/robot.local", "", "a b"])
def test_what_is_no_host_is_refused_before_anything_is_written(tmp_path: Path, host: str) -> None:
    with pytest.raises(InvalidOptionError, match="is no name or address of a machine"):
        KeyStore.init(tmp_path / "keys", [host])
    assert not (tmp_path / "keys").exists()


@pytest.mark.parametrize("damage", [*FILES, "another key", *(f"empty {file}" for file in FILES)])
def test_a_folder_that_an_interrupted_command_left_is_made_whole(store: KeyStore, damage: str) -> None:
    folder = store.folder / "robots" / "rover" / "skill.drive"
    if damage == "another key":
        (folder / "key.pem").write_bytes((store.router_folder / "key.pem").read_bytes())
    elif damage.startswith("empty"):
        (folder / damage.split()[1]).write_bytes(b"")
    else:
        (folder / damage).unlink()
    store.add_robot(ROVER)
    certificate, key = ((folder / name).read_bytes() for name in ("certificate.pem", "key.pem"))
    assert fits(certificate, key)
    assert (folder / "authority.pem").read_bytes() == (store.router_folder / "authority.pem").read_bytes()


def test_files_are_on_the_disk_before_they_take_their_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A power cut after the replacement would leave an empty file otherwise."""
    written: list[str] = []
    fsync, replace_ = os.fsync, Path.replace

    def note_write(descriptor: int) -> None:
        fsync(descriptor)
        written.append(Path(f"/proc/self/fd/{descriptor}").readlink().name)

    def note_replacement(self: Path, target: Path) -> Path:
        assert written[-1] == self.name
        return replace_(self, target)

    monkeypatch.setattr(os, "fsync", note_write)
    monkeypatch.setattr(Path, "replace", note_replacement)
    KeyStore.init(tmp_path / "keys", [])
    assert written[-1] == "names.json.new"


def test_a_damaged_certificate_hides_no_other_name(store: KeyStore) -> None:
    (store.folder / "robots" / "rover" / "launcher" / "certificate.pem").write_bytes(b"")
    ends = {holder.name: holder.expires for holder in store.holders()}
    assert ends["rover.launcher"] is None
    assert ends["rover.skill.drive"] is not None
    listed = CliRunner().invoke(app, ["keys", "list", "--keys", str(store.folder)])
    assert listed.exit_code == 0, listed.output
    assert "damaged: make it again" in listed.output
    assert "rover.skill.drive" in listed.output


@pytest.mark.parametrize("file", ["certificate.pem", "key.pem"])
def test_a_damaged_authority_is_one_sentence(store: KeyStore, file: str) -> None:
    (store.folder / "authority" / file).write_bytes(b"")
    with pytest.raises(KeysError, match=r"The authority in .* is damaged\. Restore its files from a copy, or"):
        store.add_person("alice", Role.CLIENT)


def test_a_removal_on_a_full_disk_keeps_the_name_and_its_keys(store: KeyStore, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(self: KeyStore, names: object) -> None:
        raise OSError(ENOSPC, "No space left on device")

    folder = store.add_person("alice", Role.CLIENT)
    with monkeypatch.context() as patched, pytest.raises(OSError, match="No space"):
        patched.setattr(KeyStore, "_save", fail)
        store.remove("alice")
    assert folder.exists()
    assert [holder.name for holder in store.holders() if holder.name == "alice"] == ["alice"]


def test_two_commands_at_once_lose_no_name(store: KeyStore) -> None:
    names = [f"person{number}" for number in range(8)]
    with ThreadPoolExecutor(len(names)) as pool:
        list(pool.map(lambda name: KeyStore(store.folder).add_person(name, Role.CLIENT), names))
    assert sorted(store.names().people) == names


def test_two_commands_that_prepare_an_empty_folder_make_one_authority(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first one is in the middle of its work when the second one looks for keys."""
    folder, begun, looked = tmp_path / "keys", threading.Event(), threading.Event()
    issue_, exists = KeyStore._issue, Path.exists

    def wait_for_the_other(self: KeyStore, *words: Any, **options: Any) -> None:
        if not begun.is_set():
            begun.set()
            looked.wait(LOOK)
        issue_(self, *words, **options)

    def note_look(self: Path, **options: Any) -> bool:
        found = exists(self, **options)
        if begun.is_set() and self.name == "names.json":
            looked.set()
        return found

    monkeypatch.setattr(KeyStore, "_issue", wait_for_the_other)
    monkeypatch.setattr(Path, "exists", note_look)
    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(KeyStore.prepare, folder, ["one"], [ROVER], [])
        assert begun.wait(TIMEOUT)
        second = pool.submit(KeyStore.prepare, folder, ["two"], [ROVER], [])
        store = first.result(TIMEOUT)
        second.result(TIMEOUT)
    authority = (folder / "authority" / "certificate.pem").read_bytes()
    assert {(holder.folder / "authority.pem").read_bytes() for holder in store.holders()} == {authority}
    assert {"one", "two"} <= set(store.names().hosts)
