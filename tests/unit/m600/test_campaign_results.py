"""Results of campaigns: broken promises, counts, and files that remain after an interruption."""

from __future__ import annotations

import errno
import fcntl
from io import StringIO
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace
from rich.console import Console

from skillwing.evaluation.campaign import page
from skillwing.evaluation.campaign.command import campaign, make_plans
from skillwing.evaluation.campaign.ledger import LEDGER_FILE, CampaignLedger, read_results
from skillwing.evaluation.campaign.outcomes import SHORT_HEADINGS, outcome_table, outcomes, worst_of
from skillwing.evaluation.campaign.recordings import UNFINISHED
from skillwing.evaluation.flights.conditions import Condition
from skillwing.evaluation.flights.plan import FlightNetwork, FlightPlan
from skillwing.evaluation.flights.result import End, FlightResult
from skillwing.services.errors import InvalidOptionError
from skillwing.sim_mujoco.world.kinds import KINDS

RESULTS = st.builds(
    FlightResult,
    plan=st.builds(
        FlightPlan,
        mission=st.just("mapping"),
        world=st.sampled_from(["courtyard", "street"]),
        seed=st.integers(0, 50),
        condition=st.sampled_from(Condition),
    ),
    end=st.sampled_from(End),
    phase=st.sampled_from(["SUCCEEDED", "FAILED", "ABORTED", ""]),
    collisions=st.integers(0, 2),
    breaches=st.integers(0, 2),
    clearance=st.none() | st.floats(-1.0, 10.0),
    coverage=st.none() | st.floats(0.0, 1.0),
    end_time=st.floats(0.0, 1000.0),
)


def flown(seed: int, end: End = End.HOME, phase: str = "SUCCEEDED", collisions: int = 0) -> FlightResult:
    plan = FlightPlan(mission="mapping", world="courtyard", seed=seed, condition=Condition.NONE)
    return FlightResult(plan=plan, end=end, phase=phase, collisions=collisions, clearance=2.0)


@given(RESULTS)
def test_a_promise_is_kept_by_a_drone_that_hits_nothing_stays_inside_and_comes_down(result: FlightResult) -> None:
    down = result.end in (End.HOME, End.ELSEWHERE, End.HANDED_OVER)
    assert result.kept == (down and not result.collisions and not result.breaches)
    assert result.kept == (not result.broken)


@given(st.lists(RESULTS, max_size=20))
def test_every_flight_is_counted_once_in_its_row_and_once_in_all(results: list[FlightResult]) -> None:
    rows = outcomes(results)
    single = [row for row in rows if row.world != "all"]
    assert sum(row.flights for row in single) == len(results)
    for row in rows:
        assert row.at_home + row.elsewhere + row.handed_over + row.not_landed == row.flights
    if len(single) > 1:
        assert rows[-1].flights == len(results)
        assert rows[-1].collided == sum(row.collided for row in single)


def test_the_outcomes_of_one_world_fit_a_terminal_of_80_columns() -> None:
    results = [replace(flown(seed), end_time=1234.5, coverage=0.999) for seed in range(1000)]
    pilot = FlightPlan(mission="mapping", world="courtyard", seed=1, condition=Condition.PILOT_RETURNS)
    results.append(replace(flown(1), plan=pilot, end_time=1234.5))
    console = Console(width=80, record=True, file=StringIO())
    console.print(outcome_table(outcomes(results)))
    head, none, returns, total, *_ = console.export_text().splitlines()
    assert head.split() == list(SHORT_HEADINGS[1:])
    assert " ".join(none.split()) == "none 1000 0 1000 0 1000 0 0 0 0 0 2.00 m 100 % 1234 s"
    assert returns.split()[:4] == ["pilot-returns", "1", "1", "1"]
    assert total.split()[:2] == ["all", "1001"]


def test_a_broken_promise_is_worse_than_any_failure() -> None:
    kept, failed, hit = flown(1), flown(2, phase="FAILED"), flown(3, collisions=1)
    assert worst_of([failed, hit, kept], 3) == [hit, failed, kept]
    assert worst_of([failed, hit, kept], 1) == [hit]


def test_a_campaign_that_was_killed_goes_on_after_its_last_whole_line(tmp_path: Path) -> None:
    ledger = CampaignLedger(tmp_path, resume=False)
    for seed in (1, 2):
        ledger.add(flown(seed))
    ledger.close()
    with (tmp_path / LEDGER_FILE).open("ab") as file:
        file.write(b'{"plan": {"mission": "map')
    resumed = CampaignLedger(tmp_path, resume=True)
    assert resumed.results == [flown(1), flown(2)]
    resumed.add(flown(3))
    resumed.close()
    again = CampaignLedger(tmp_path, resume=True)
    again.close()
    assert again.results == [flown(1), flown(2), flown(3)]


def test_no_two_campaigns_fly_into_one_folder(tmp_path: Path) -> None:
    first = CampaignLedger(tmp_path, resume=False)
    first.add(flown(1))
    half = tmp_path / f"{flown(2).plan.name}{UNFINISHED}"
    half.mkdir()
    with pytest.raises(InvalidOptionError, match="Another campaign is flying into"):
        campaign("mapping", seeds="2", output=tmp_path, resume=True, record=True)
    assert half.is_dir()
    first.add(flown(3))
    first.close()
    again = CampaignLedger(tmp_path, resume=True)
    again.close()
    assert again.results == [flown(1), flown(3)]


def test_where_a_folder_cannot_be_locked_a_campaign_flies_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def flock(file: object, operation: int) -> None:
        raise OSError(errno.ENOTSUP, "Operation not supported")

    monkeypatch.setattr(fcntl, "flock", flock)
    ledger = CampaignLedger(tmp_path, resume=False)
    ledger.add(flown(1))
    ledger.close()
    assert "cannot be locked (Operation not supported)" in caplog.text
    assert read_results(tmp_path / LEDGER_FILE) == [flown(1)]


def test_a_campaign_is_not_written_over(tmp_path: Path) -> None:
    CampaignLedger(tmp_path, resume=False).close()
    with pytest.raises(InvalidOptionError, match="--resume"):
        CampaignLedger(tmp_path, resume=False)


def test_a_folder_holds_one_campaign(tmp_path: Path) -> None:
    ledger = CampaignLedger(tmp_path, resume=False)
    for seed in (1, 2):
        ledger.add(flown(seed))
    plan = ledger.results[0].plan
    ledger.require([replace(plan, seed=seed) for seed in range(5)])
    for others in (
        [replace(plan, seed=seed, watched=False) for seed in range(5)],
        [replace(plan, seed=seed, world="street") for seed in range(5)],
        [replace(plan, seed=seed, happens={}) for seed in range(5)],
        [plan],
    ):
        with pytest.raises(InvalidOptionError, match="would not fly: mapping-courtyard-none-"):
            ledger.require(others)
    ledger.close()


def test_a_campaign_is_not_gone_on_with_in_the_folder_of_another(tmp_path: Path) -> None:
    ledger = CampaignLedger(tmp_path, resume=False)
    ledger.add(flown(1))
    ledger.close()
    with pytest.raises(InvalidOptionError, match="Give the options of the campaign in there"):
        campaign("mapping", seeds="0:5", without_obstacles=True, output=tmp_path, resume=True)
    again = CampaignLedger(tmp_path, resume=True)
    again.close()
    assert again.results == [flown(1)]


@given(
    st.lists(
        st.tuples(
            st.sets(st.sampled_from(sorted(KINDS)), min_size=1),
            st.sets(st.sampled_from(Condition), min_size=1),
            st.booleans(),
            st.sampled_from(FlightNetwork),
            st.booleans(),
        ),
        min_size=2,
        max_size=2,
        unique_by=repr,
    )
)
def test_no_campaign_has_the_title_of_another_one(
    two: list[tuple[set[str], set[Condition], bool, FlightNetwork, bool]],
) -> None:
    one, other = (
        page.title_of(
            [
                FlightPlan(mission="mapping", world=kind, seed=1, condition=met, watched=watched, network=network)
                for kind in kinds
                for met in conditions
            ],
            repeated=repeated,
        )
        for kinds, conditions, watched, network, repeated in two
    )
    assert (one == other) == (two[0] == two[1])


def test_the_title_tells_what_is_flown() -> None:
    plans = make_plans("mapping", "0:2", "all", None)
    assert page.title_of(plans) == "mapping in courtyard: all conditions"
    plans = make_plans("mapping", "0:2", "camera,none", "village,street", watched=False, network=FlightNetwork.ZENOH)
    told = "mapping in street, village: none, camera, without obstacle detection, over Zenoh, flown again"
    assert page.title_of(plans, repeated=True) == told
    text = page.section(told, [], [flown(1)], outcomes([flown(1)]), "abc")
    assert text.startswith(f"## M{told[1:]}\n")


def test_a_file_that_is_no_ledger_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / LEDGER_FILE).write_text("shopping list\n", encoding="utf-8")
    with pytest.raises(InvalidOptionError, match=r"Line 1 of .* is no flight"):
        CampaignLedger(tmp_path, resume=True)
    assert (tmp_path / LEDGER_FILE).read_text(encoding="utf-8") == "shopping list\n"


def test_a_page_without_place_is_reported_before_anything_flies(tmp_path: Path) -> None:
    path, folder = tmp_path / "missions.md", tmp_path / "flights"
    path.write_text("<!-- campaign: mapping in courtyard: none -->\nhalf a section\n", encoding="utf-8")
    with pytest.raises(InvalidOptionError, match="lacks `<!-- end of campaign: mapping in courtyard: none -->`"):
        campaign("mapping", seeds="0", output=folder, write=path)
    assert not folder.exists()


def test_each_row_tells_how_many_flights_met_their_condition_before_the_drone_was_down() -> None:
    lost = [{"sensor": sensor, "kind": "blackout", "at": at} for sensor, at in (("zed", 40.0), ("lidar", 60.0))]
    camera = FlightPlan(
        mission="mapping", world="courtyard", seed=1, condition=Condition.CAMERA, happens={"faults": lost[:1]}
    )
    both = replace(camera, condition=Condition.BOTH, happens={"faults": lost})
    results = [replace(flown(1), plan=plan, end_time=end) for plan in (camera, both) for end in (39.0, 50.0, 100.0)]
    rows = outcomes([*results, flown(2)])
    assert [(row.condition, row.flights, row.met) for row in rows] == [
        ("none", 1, 0),
        ("camera", 3, 2),
        ("both", 3, 1),
        ("all", 7, 3),
    ]
    text = page.section("Mapping", ["skillwing"], [*results, flown(2)], rows, "abc")
    assert "Met: in 3 of 6 flights every planned fault began before the drone was down" in text
    assert "was down, 40 to 60 s after the start." in text
    assert "| courtyard | both | 3 | 1 |" in text
    assert "No flight broke a promise" in text
    assert "least clearance: `mapping-courtyard-camera-1`," in text
    assert "Met:" not in page.section("Mapping", ["skillwing"], [flown(2)], outcomes([flown(2)]), "abc")


def test_the_worst_flights_are_named_where_none_broke_a_promise() -> None:
    near, failed = replace(flown(2), clearance=0.4), flown(3, phase="FAILED")
    results = [flown(1), near, failed]
    text = page.section("Mapping", ["skillwing"], results, outcomes(results), "abc")
    names = ", ".join(f"`{each.plan.name}`" for each in (failed, near, flown(1)))
    assert f"The worst of them, failures first and then by their least clearance: {names}." in text


@pytest.mark.parametrize(("worlds", "one_in"), [(5, 2), (20, 7), (100, 33)])
def test_without_broken_promises_their_rate_has_a_bound(worlds: int, one_in: int) -> None:
    results = [flown(seed) for seed in range(worlds)]
    twice = [*results, *results]
    text = page.section("Mapping", ["skillwing"], twice, outcomes(twice), "abc")
    expected = f"a broken promise is to be expected in fewer than one of {one_in} like them (95 % confidence)."
    assert f"With none in {worlds} worlds, {expected}" in text
    # Were it more frequent, fewer than one campaign in 20 would see none.
    assert (1.0 - 1.0 / one_in) ** worlds < 0.05 < (1.0 - 1.0 / (one_in + 1)) ** worlds


def test_few_worlds_tell_nothing_of_how_rare_a_broken_promise_is() -> None:
    results = [flown(seed) for seed in range(4)]
    assert "confidence" not in page.section("Mapping", ["skillwing"], results, outcomes(results), "abc")


def test_a_section_replaces_the_one_before_and_leaves_the_rest_of_the_page(tmp_path: Path) -> None:
    path = tmp_path / "missions.md"
    path.write_text("# Missions\n\nWords.\n", encoding="utf-8")
    for results in ([flown(1)], [flown(1), flown(2), flown(4, collisions=1)]):
        words = ["skillwing", "campaign", "mapping"]
        page.write(path, "mapping", page.section("Mapping", words, results, outcomes(results), "abc"))
        page.write(path, "other", page.section("Other", words, [flown(9)], outcomes([flown(9)]), "abc"))
    text = path.read_text(encoding="utf-8")
    assert text.startswith(
        "# Missions\n\nWords.\n\n<!-- campaign: mapping -->\n## Mapping\n\n3 flights of seeds 1 to 2, 4 by code abc;"
    )
    assert text.count("## Mapping") == text.count("## Other") == 1
    assert "| mapping-courtyard-none-4 | 1 collision |" in text


@pytest.mark.parametrize("wrong", [b"", b'{"plan": ', b"no flight"])
def test_a_line_that_is_no_flight_is_reported_by_its_number(tmp_path: Path, wrong: bytes) -> None:
    lines = [msgspec.json.encode(flown(seed)) for seed in range(3)]
    (tmp_path / LEDGER_FILE).write_bytes(b"\n".join([*lines[:2], wrong, lines[2], b""]))
    with pytest.raises(InvalidOptionError, match=r"Line 3 of .* is no flight: .*Take this line out"):
        CampaignLedger(tmp_path, resume=True)


def test_a_flight_counts_once(tmp_path: Path) -> None:
    lines = [msgspec.json.encode(flown(seed)) for seed in (0, 1, 0)]
    (tmp_path / LEDGER_FILE).write_bytes(b"\n".join([*lines, b""]))
    with pytest.raises(InvalidOptionError, match=r"Line 3 of .* an earlier line is, too"):
        CampaignLedger(tmp_path, resume=True)
