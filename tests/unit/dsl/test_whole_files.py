"""Files that are written whole or not at all."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

import small_disk
from skillwing.dsl.whole_files import write_whole

PAGE = 4096
SOURCE = f"skillset s {{{' '.join(f'resource r{n} {{initial A A->B}}' for n in range(120))}}}"
"""A skillset that takes one page of a disk, and more when it is formatted."""


@pytest.mark.parametrize("content", ["neu: ä\r\n", "neu: ä\r\n".encode()])
def test_the_content_replaces_that_of_before(tmp_path: Path, content: bytes | str) -> None:
    file = tmp_path / "file"
    for _ in range(2):
        write_whole(file, content)
        assert file.read_bytes() == "neu: ä\r\n".encode()
    assert list(tmp_path.iterdir()) == [file]


def test_a_link_stays_one_and_the_file_keeps_its_mode(tmp_path: Path) -> None:
    file, link = tmp_path / "file", tmp_path / "link"
    file.write_text("old")
    file.chmod(0o640)
    link.symlink_to(file)
    write_whole(link, "new")
    assert link.is_symlink()
    assert (file.read_text(), file.stat().st_mode & 0o777) == ("new", 0o640)


def test_a_pipe_is_written_to(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_whole(pipe, "new")
        assert os.read(reader, 10) == b"new"
    finally:
        os.close(reader)


@pytest.mark.parametrize("name", ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"])
def test_a_name_of_an_open_stream_is_written_to(name: str) -> None:
    imports = "import sys; from pathlib import Path; from skillwing.dsl.whole_files import write_whole"
    command = [sys.executable, "-c", f"{imports}; write_whole(Path(sys.argv[1]), 'new')", name]
    assert subprocess.run(command, capture_output=True, check=True).stdout == b"new"


def test_a_file_that_may_not_be_written_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "file"
    file.write_text("old")
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may write everything
    with pytest.raises(PermissionError):
        write_whole(file, "new")
    assert file.read_text() == "old"


def test_a_file_that_cannot_be_replaced_is_written_in_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def replace(self: Path, target: Path) -> None:
        raise OSError(errno.EBUSY, "busy", str(self), None, str(target))

    file = tmp_path / "file"
    file.write_text("old")
    monkeypatch.setattr(Path, "replace", replace)
    write_whole(file, "new")
    assert [(each.name, each.read_text()) for each in tmp_path.iterdir()] == [("file", "new")]


@pytest.mark.parametrize("place", ["missing/file", "folder"])
def test_an_error_names_the_file(tmp_path: Path, place: str) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(OSError, match=place) as failed:
        write_whole(tmp_path / place, "new")
    assert failed.value.filename == str(tmp_path / place)
    assert "->" not in str(failed.value)
    assert list(tmp_path.iterdir()) == [tmp_path / "folder"]


@pytest.mark.skipif(small_disk.obstacle() is not None, reason=str(small_disk.obstacle()))
def test_on_a_full_disk_a_skillset_that_is_formatted_stays(tmp_path: Path) -> None:
    with small_disk.mounted(tmp_path / "disk", 4 * PAGE) as disk:
        file = disk / "lamp.skillset"
        file.write_text(SOURCE)
        small_disk.fill(disk)
        words = [sys.executable, "-m", "skillwing.services.terminal.cli", "fmt", str(file)]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        assert file.read_text() == SOURCE
        assert sorted(each.name for each in disk.iterdir()) == [small_disk.FILLER, "lamp.skillset"]
        assert (done.returncode, done.stderr) == (2, f"`{file}` cannot be written: No space left on device.\n")
