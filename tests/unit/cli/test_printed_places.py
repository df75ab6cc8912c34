"""Printed text equals the written text, also if it looks like markup of rich."""

from __future__ import annotations

import pytest

from skillwing.services.terminal.output import make_console, print_table


@pytest.mark.parametrize("terminal", [False, True])
def test_a_place_in_a_file_is_no_picture(
    terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("TTY_COMPATIBLE", str(int(terminal)))
    console = make_console()
    assert console.is_terminal is terminal
    console.print("a.xml:100: unmarked", markup=False)
    console.print("a.xml:100: marked")
    print_table(console, ("PLACE",), [("a.xml:100: in a table",)])
    said = capsys.readouterr().out
    for how in ("unmarked", "marked", "in a table"):
        assert f"a.xml:100: {how}" in said
