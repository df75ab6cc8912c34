"""The page about testing is held to what it says: its examples are run, and its story is what a failure tells."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "testing.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
FAILURE = """

def test_of_the_emergency_stop_expecting_too_much() -> None:
    test = rover()
    goal = test.start(target=HERE)
    test.set_states(emergency_stop="PRESSED")
    try:
        goal.assert_ended("S_ARRIVED")
    except AssertionError as failure:
        print(f"{failure}\\nEND OF STORY")
"""


def test_every_example_runs_and_prints_the_story_of_the_page(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = pytester.makepyfile(test_page="\n\n".join(EXAMPLES) + FAILURE)
    monkeypatch.chdir(ROOT)
    result = pytester.runpytest_inprocess("-rP", "-p", "no:cacheprovider", file)
    result.assert_outcomes(passed=7)
    told = re.search(r"^(The goal of .*?)\nEND OF STORY$", result.stdout.str(), re.MULTILINE | re.DOTALL)
    shown = re.search(r"^```text\n(.*?)\n```", PAGE, re.MULTILINE | re.DOTALL)
    assert told is not None
    assert shown is not None
    assert shown[1] == told[1]
