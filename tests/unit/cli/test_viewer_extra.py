"""Messages of commands for which the packages of the extra `viewer` are not installed."""

from __future__ import annotations

import sys

import pytest

from skillwing.services.errors import InvalidOptionError
from skillwing.services.viewer_extra import viewer_module

PICTURE = "skillwing.services.report.timeline_picture"


def test_a_missing_package_is_named_with_the_extra_that_brings_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("matplotlib")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delitem(sys.modules, PICTURE, raising=False)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(InvalidOptionError, match=r"matplotlib\S* is not installed.*skillwing\[viewer\]"):
        viewer_module(PICTURE, "--png")


def test_names_in_strings_lead_to_modules() -> None:
    for name in ("run_reports", "rendering", "timeline_picture"):
        assert viewer_module(f"skillwing.services.report.{name}", "RUN").__name__.endswith(name)
