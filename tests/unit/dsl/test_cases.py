"""Each file under `cases/` says in its first line which diagnostics it gets, in file order."""

from __future__ import annotations

from pathlib import Path

import pytest

from skillwing.dsl.checking.checker import check
from skillwing.dsl.diagnostics.codes import CODES

CASES = Path(__file__).parent / "cases"
FILES = sorted(CASES.glob("*/*.skillset"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_file_gets_exactly_the_expected_diagnostics(path: Path) -> None:
    text = path.read_text()
    expected = text.split("\n", 1)[0].removeprefix("// expect:").split()
    checked = check(text, path.name)
    assert [diagnostic.code for diagnostic in checked.diagnostics] == expected
    assert (checked.skillset is not None) == (path.parent.name == "valid")


def test_every_code_has_a_case() -> None:
    files = (*FILES, *CASES.glob("rl/*/*.rl"))
    shown = {code for path in files for code in path.read_text().split("\n", 1)[0].split() if code in CODES}
    assert shown == set(CODES)
