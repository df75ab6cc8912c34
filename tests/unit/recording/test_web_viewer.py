"""Address of the web viewer in a system without a terminal."""

from __future__ import annotations

from urllib.parse import parse_qs, urlsplit

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.services.errors import InvalidOptionError
from skillwing.services.viewer.viewer import page_address
from skillwing.services.viewer.web_viewer import PATIENCE, StartupNotice, make_web_viewer

ADDRESS = page_address("127.0.0.1:9090", "127.0.0.1:9876")
NAMES = ("sim", "bridge", "skill/hover")
LOOKS = st.lists(st.tuples(st.sets(st.sampled_from((*NAMES, "client/7"))), st.floats(0.0, 2 * PATIENCE)), max_size=20)


def test_the_address_opens_the_stream_in_the_page() -> None:
    parts = urlsplit(page_address("127.0.0.1:8000", "127.0.0.1:8001"))
    assert (parts.scheme, parts.netloc) == ("http", "127.0.0.1:8000")
    assert parse_qs(parts.query) == {"theme": ["dark"], "url": ["rerun+http://127.0.0.1:8001/proxy"]}


def test_the_address_is_printed_when_all_processes_are_up() -> None:
    notice = StartupNotice("m600", NAMES, ADDRESS, now=100.0)
    assert notice.lines({"sim", "bridge"}, 101.0) == []
    assert notice.lines(NAMES, 102.0) == ["m600: all 3 processes run.", f"Open {ADDRESS}"]
    assert notice.lines({"sim"}, 100.0 + 2 * PATIENCE) == []


def test_who_is_missing_for_long_is_named_and_does_not_keep_anybody_from_looking() -> None:
    notice = StartupNotice("m600", NAMES, ADDRESS, now=100.0)
    told = notice.lines({"bridge"}, 100.0 + PATIENCE)
    assert told[0].startswith("m600: 2 of 3 processes have not come up: sim, skill/hover.")
    assert told[1] == f"Open {ADDRESS}"
    assert notice.lines({"bridge"}, 101.0 + PATIENCE) == []
    assert notice.lines(NAMES, 102.0 + PATIENCE)[0] == "m600: all 3 processes run."


@given(looks=LOOKS)
def test_whatever_happens_the_last_line_is_the_address_and_there_are_two_of_them_at_most(
    looks: list[tuple[set[str], float]],
) -> None:
    notice = StartupNotice("m600", NAMES, ADDRESS, now=0.0)
    told: list[str] = []
    for here, now in sorted(looks, key=lambda look: look[1]):
        told += notice.lines(here, now)
        if set(NAMES) <= here:
            assert notice.complete
    assert told.count(f"Open {ADDRESS}") * 2 == len(told) <= 4
    assert not told or told[-1] == f"Open {ADDRESS}"


@pytest.mark.parametrize("options", [{}, {"robot": "m600", "port": 1}, {"robot": 7}])
def test_options_that_mean_nothing_are_refused(options: dict[str, object]) -> None:
    with pytest.raises(InvalidOptionError, match="Its options: robot, bind, page, stream"):
        make_web_viewer(options)
