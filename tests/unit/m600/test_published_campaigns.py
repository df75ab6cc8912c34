"""The tables in docs/missions.md are those of the flights in docs/campaigns, each of which has a line there."""

from __future__ import annotations

from pathlib import Path

import pytest

from skillwing.m600.campaign import page
from skillwing.m600.campaign.flight_code import read_code
from skillwing.m600.campaign.ledger import LEDGER_FILE, read_results
from skillwing.m600.campaign.outcomes import outcomes

DOCS = Path(__file__).parents[3] / "docs"
PUBLISHED = sorted(path.parent for path in (DOCS / "campaigns").glob(f"*/{LEDGER_FILE}"))


@pytest.mark.parametrize("folder", PUBLISHED, ids=[folder.name for folder in PUBLISHED])
def test_a_table_tells_the_published_flights(folder: Path) -> None:
    results = read_results(folder / LEDGER_FILE)
    title = page.title_of([result.plan for result in results], again=folder.name == "zenoh")
    told = page.read(DOCS / "missions.md", title)
    assert f"{len(results)} flights" in told
    assert f"by code {read_code(folder).digest};" in told
    for row in outcomes(results):
        assert f"| {' | '.join(row.cells)} |" in told.splitlines()
    for result in results:
        assert (result.plan.command in told) == (not result.kept)
