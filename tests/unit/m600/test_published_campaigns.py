"""The tables in docs/missions.md are those of the flights in docs/campaigns, each folder of which has a section."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from skillwing.m600.campaign import page
from skillwing.m600.campaign.again import Sample, comparison
from skillwing.m600.campaign.conditions import Condition, conditions_of
from skillwing.m600.campaign.flight_code import FlightCode, claim, read_code
from skillwing.m600.campaign.ledger import LEDGER_FILE, Ledger, read_results
from skillwing.m600.campaign.outcomes import outcomes
from skillwing.m600.campaign.plan import FlightPlan
from skillwing.m600.campaign.result import End, FlightResult

ROOT = Path(__file__).parents[3]
PAGE, CAMPAIGNS = ROOT / "docs" / "missions.md", ROOT / "docs" / "campaigns"
MAPPING, UNWATCHED, ZENOH = CAMPAIGNS / "mapping", CAMPAIGNS / "unwatched", CAMPAIGNS / "zenoh"
TITLE = re.compile(r"^<!-- campaign: (.+) -->$", re.MULTILINE)


def published(campaigns: Path) -> list[Path]:
    return sorted(path.parent for path in campaigns.glob(f"*/{LEDGER_FILE}"))


def flights_in(folder: Path) -> list[FlightResult]:
    """Those that are published there; the test is skipped where none are."""
    if not (folder / LEDGER_FILE).exists():
        pytest.skip(f"No flights are published in {folder}.")
    return read_results(folder / LEDGER_FILE)


def title_of(folder: Path) -> str:
    plans = [result.plan for result in read_results(folder / LEDGER_FILE)]
    return page.title_of(plans, again=folder.name == ZENOH.name)


def partings(path: Path, campaigns: Path) -> tuple[set[str], set[str]]:
    """Titles of sections whose flights are not there, and of flights that have no section."""
    told, flown = set(TITLE.findall(path.read_text(encoding="utf-8"))), set(map(title_of, published(campaigns)))
    return told - flown, flown - told


def test_each_section_has_its_flights_and_all_flights_have_a_section() -> None:
    assert partings(PAGE, CAMPAIGNS) == (set(), set())


def test_a_section_without_flights_and_flights_without_a_section_are_found(tmp_path: Path) -> None:
    path, campaigns = tmp_path / "missions.md", tmp_path / "campaigns"
    plan = FlightPlan(mission="mapping", world="courtyard", seed=1, condition=Condition.NONE)
    results = [FlightResult(plan=plan, end=End.HOME)]
    ledger = Ledger(campaigns / "mapping", resume=False)
    ledger.add(results[0])
    ledger.close()
    claim(campaigns / "mapping", FlightCode({}))
    page.write(path, "other", "## Other")
    assert partings(path, campaigns) == ({"other"}, {"mapping in courtyard: none"})
    page.write(path, page.title_of([plan]), page.section(page.title_of([plan]), [], results, outcomes(results), ""))
    assert partings(path, campaigns) == ({"other"}, set())


@pytest.mark.parametrize("folder", published(CAMPAIGNS), ids=lambda folder: folder.name)
def test_a_table_tells_the_published_flights(folder: Path) -> None:
    results = read_results(folder / LEDGER_FILE)
    told = page.read(PAGE, title_of(folder))
    assert f"{len(results)} flights" in told
    assert f"by code {read_code(folder).digest};" in told
    for row in outcomes(results):
        assert f"| {' | '.join(row.cells)} |" in told.splitlines()
    for result in results:
        assert (result.plan.command in told) == (not result.kept)


def test_each_courtyard_was_flown_under_all_conditions() -> None:
    flown: dict[int, set[Condition]] = {}
    for result in flights_in(MAPPING):
        flown.setdefault(result.plan.seed, set()).add(result.plan.condition)
    all_of_them = set(conditions_of("mapping")) - {Condition.PILOT_RETURNS}
    assert {seed: all_of_them - met for seed, met in flown.items() if met != all_of_them} == {}


def test_drones_collide_where_nobody_looks_ahead_and_not_where_obstacle_detection_does() -> None:
    """Which is what makes it mean something that drones hit nothing."""
    collided = {each.plan.seed for each in flights_in(UNWATCHED) if each.collisions}
    watched = {each.plan.seed: each for each in flights_in(MAPPING) if each.plan.condition is Condition.NONE}
    assert collided
    assert not any(watched[seed].collisions for seed in collided)


def test_the_sample_with_real_processes_is_told_beside_the_flights_it_repeats() -> None:
    results = flights_in(ZENOH)
    told = page.read(PAGE, title_of(ZENOH)).splitlines()
    assert set(comparison(Sample(MAPPING, flights_in(MAPPING), read_code(MAPPING)), results)) <= set(told)


def test_the_first_example_flies_what_make_campaign_does() -> None:
    example = next(line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("skillwing "))
    command, write, output = example.partition(" --write docs/missions.md -o docs/campaigns/mapping")
    assert (write, output) == (" --write docs/missions.md -o docs/campaigns/mapping", "")
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert f"$(CAMPAIGN) {command.removeprefix('skillwing campaign ')} $(CAMPAIGN_PAGE)/mapping\n" in makefile
    assert "CAMPAIGN_DIR ?= docs/campaigns\n" in makefile
