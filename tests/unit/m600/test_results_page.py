"""The page of the paper's results: what is flown for it, what a flight costs, and what the page says of it."""

from __future__ import annotations

import math
import shlex
import sys
from collections import Counter
from functools import partial
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import to_rgb
from matplotlib.image import imread
from msgspec.structs import replace

from benchmark_scripts import script
from skillwing.bt_missions.checking.mission_check import check_mission, offline_context
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.library import find_mission
from skillwing.bt_missions.mission.mission import MissionTrees
from skillwing.evaluation.campaign.flight_code import FlyingCode
from skillwing.evaluation.campaign.worker_pool import WorkerPool
from skillwing.evaluation.flights.cost import AWAY, LIVE_FOR, Cost, CostMeter
from skillwing.evaluation.flights.plan import FlightPlan, planned_circle
from skillwing.evaluation.flights.result import End, FlightResult
from skillwing.evaluation.judge.flight_log import FLIGHT_FILE
from skillwing.m600.robot import ROBOT
from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.flight import Battery, FlightState
from skillwing.onboard.topics.truth import Truth
from skillwing.onboard.topics.video import VideoStatus
from skillwing.services.errors import SkillwingError
from skillwing.services.history.files import TIMELINE_FILE, JsonLines
from skillwing.services.protocol import Record, RecordKind

flights = script("paper/paper_flights")
page = script("paper/paper_page")
pictures = script("paper/cost_picture")
ways = script("paper/way_picture")
run = script("paper/run")
PLANS = flights.paper_plans(range(2))


def plan_of(mission: str, label: str, seed: int) -> FlightPlan:
    (found,) = (
        plan for plan in flights.paper_plans(range(seed, seed + 1)) if (plan.mission, plan.label) == (mission, label)
    )
    return found


# --- what is flown ---------------------------------------------------------------------------------------------------


def test_every_flight_has_a_name_of_its_own_and_fits_the_robot() -> None:
    plans = flights.paper_plans(range(2))
    assert len({plan.name for plan in plans}) == len(plans) == 20
    skillset = ROBOT.load_skillset()
    for plan in plans[:10]:
        mission = find_mission(plan.flown)
        assert check_mission(mission, skillset, mission.read_options(plan.mission_options())) == []


def test_the_command_of_a_flight_is_that_very_flight() -> None:
    plan = plan_of("mapping", "none", 1)
    *_, told = shlex.split(plan.command)
    assert msgspec.json.decode(told, type=FlightPlan) == plan


def test_a_flight_is_found_again_in_its_ledger() -> None:
    for plan in flights.paper_plans(range(1)):
        assert msgspec.json.decode(msgspec.json.encode(plan), type=FlightPlan) == plan


def rehearsed(plan: FlightPlan) -> MissionTrees:
    found, skillset = find_mission(plan.flown), ROBOT.load_skillset()
    trees, problems = found.draft(offline_context(skillset), found.read_options(plan.mission_options()))
    assert problems == []
    return trees


@pytest.mark.parametrize(
    ("mission", "alternatives"),
    [("mapping", {"LiDAR branch", "come home"}), ("inspection", {"hover, then land", "come home"})],
)
def test_who_aborts_has_no_alternative_but_the_landing_of_the_guards(mission: str, alternatives: set[str]) -> None:
    library = find_mission(mission)
    plan = plan_of(mission, "abort", 0)
    options = {name: value for name, value in plan.mission_options().items() if name != "instead"}
    own, _ = library.draft(offline_context(ROBOT.load_skillset()), library.read_options(options))
    before = [node.name for node in own.root.iterate()]
    left_out = [node for node in own.root.iterate() if node.name in alternatives]
    assert len(left_out) == len(alternatives)
    after = Counter(node.name for node in rehearsed(plan).root.iterate())
    assert Counter(before) - after == Counter(node.name for branch in left_out for node in branch.iterate())
    assert after["land where it is"] == 1


@pytest.mark.parametrize(
    ("mission", "label", "leads", "skills"),
    [
        ("mapping", "home", "home at once", ["lidar_depthmap", "return_home"]),
        ("mapping", "none", "fly on", ["goto_straight", "return_home"]),
        ("inspection", "home", "hover, then land", ["lidar_depthmap", "return_home"]),
        ("inspection", "none", "nobody watches", ["stream"]),
    ],
)
def test_each_other_answer_is_flown_where_the_library_has_its_own(
    mission: str, label: str, leads: str, skills: list[str]
) -> None:
    trees = rehearsed(plan_of(mission, label, 0))
    (branch,) = (node for node in trees.root.iterate() if node.name == leads)
    assert [leaf.skill for leaf in branch.iterate() if isinstance(leaf, SkillAction)] == skills
    assert not any(node.name == "LiDAR branch" for node in trees.root.iterate())


@pytest.mark.parametrize("mission", ["mapping", "inspection"])
def test_all_policies_but_the_nominal_one_meet_the_same_failure(mission: str) -> None:
    nominal, *others = (plan_of(mission, policy.label, 3) for policy in flights.POLICIES[mission])
    met = [plan.circumstances() for plan in others]
    assert met[0]
    assert met == met[:1] * len(others)
    assert not any(nominal.circumstances().values())


@given(st.integers(0, 1000))
def test_the_camera_fails_early_in_some_flights_and_late_in_others(first: int) -> None:
    route = flights.way_time(flights.planned_way(plan_of("mapping", "nominal", 0).site(), "mapping"))
    shares = [flights.camera_fails_at(seed) / route for seed in range(first, first + 5)]
    assert all(0.0 < share < 2.0 for share in shares)
    assert max(shares) - min(shares) > 0.4


def works(monkeypatch: pytest.MonkeyPatch, source: str) -> None:
    """Let Python code fly; it gets the plan and the folder for its recording."""
    monkeypatch.setattr(run, "WorkerPool", partial(WorkerPool, worker=(sys.executable, "-c", source)))


RECORDS = """
import sys
from pathlib import Path
import msgspec
from skillwing.evaluation.flights.plan import FlightPlan
from skillwing.evaluation.flights.result import End, FlightResult
Path(sys.argv[2], "map.png").touch(exist_ok=False)
plan = msgspec.json.decode(sys.argv[1], type=FlightPlan)
sys.stdout.buffer.write(msgspec.json.encode(FlightResult(plan=plan, end=End.HOME)))
"""


def test_half_a_recording_is_not_taken_for_a_whole_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = plan_of("mapping", "nominal", 0)
    flying = FlyingCode([])
    works(monkeypatch, "import sys; open(sys.argv[2] + '/map.png', 'w').close(); sys.exit('killed')")
    with pytest.raises(SkillwingError, match=f"no result of {plan.name}. .* killed"):
        run.fly([plan], tmp_path, 1, flying)
    assert run.draw_pictures([plan], tmp_path, tmp_path / "images") == set()

    works(monkeypatch, RECORDS)
    assert run.fly([plan], tmp_path, 1, flying)[-1].end is End.HOME
    assert [each.name for each in tmp_path.iterdir() if each.is_dir() and each.name != "images"] == [plan.name]
    works(monkeypatch, "raise SystemExit('nothing is missing')")
    assert len(run.fly([plan], tmp_path, 1, flying)) == 1


def test_a_page_without_marks_is_reported_before_anything_flies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page_file = tmp_path / "results.md"
    page_file.write_text("words\n", encoding="utf-8")
    monkeypatch.setattr(run, "PAGE", page_file)
    monkeypatch.setattr(run, "fly", lambda *_: pytest.fail("it flies"))
    monkeypatch.setattr(sys, "argv", ["run.py", "-o", str(tmp_path)])
    with pytest.raises(SystemExit):
        run.main()
    assert "lacks `<!-- figures: make paper -->`" in capsys.readouterr().err


# --- what a flight costs ---------------------------------------------------------------------------------------------

CIRCLE = tuple((10.0 * math.cos(k * math.pi / 2), 10.0 * math.sin(k * math.pi / 2), 5.0) for k in range(4))


def truth(t: float, position: Vector3) -> Truth:
    return Truth(
        t=t,
        position=position,
        quaternion=(1.0, 0.0, 0.0, 0.0),
        velocity=(0.0, 0.0, 0.0),
        collisions=0,
        clearance=1.0,
        inside_fence=True,
    )


def picture(t: float, fps: float = 20.0, quality: float | None = 0.9) -> VideoStatus:
    return VideoStatus(t=t, stream="s", fps=fps, quality=quality, bitrate=1e6, lost=0.0, latency=0.1)


def airborne(circle: tuple[Vector3, ...] = ()) -> CostMeter:
    meter = CostMeter(circle)
    meter.flight(FlightState(t=0.0, on_ground=False, rotors_on=True, home_valid=True, authority=True))
    return meter


def test_a_meter_that_saw_nothing_knows_nothing() -> None:
    assert CostMeter().cost == Cost()


def test_charge_is_what_went_out_of_the_battery() -> None:
    meter = CostMeter()
    for percent in (90.0, 89.0, 84.5):
        meter.charge(Battery(t=0.0, percent=percent, voltage=24.0))
    assert meter.cost.charge == 5.5


@given(st.lists(st.booleans(), min_size=4, max_size=4))
def test_corners_count_as_seen_when_there_is_video_while_they_are_passed(live: list[bool]) -> None:
    meter = airborne(CIRCLE)
    for k, corner in enumerate(CIRCLE[:3]):
        t = 10.0 * k
        if live[k]:
            meter.video(picture(t))
        meter.truth(truth(t, corner))
    assert meter.cost.circled == 0.75
    assert meter.cost.circled_live == sum(live[:3]) / 4


@given(st.floats(0.0, 30.0))
def test_seconds_without_video_count_away_from_home_from_the_first_picture_on(silence: float) -> None:
    meter, step = airborne(), 0.25
    meter.truth(truth(0.0, (2 * AWAY, 0.0, 5.0)))
    meter.truth(truth(50.0, (2 * AWAY, 0.0, 5.0)))
    assert meter.cost.unseen is None
    meter.video(picture(50.0))
    for k in range(1, 1 + int(silence / step)):
        meter.truth(truth(50.0 + k * step, (2 * AWAY, 0.0, 5.0)))
    assert meter.cost.unseen == pytest.approx(max(0.0, step * int(silence / step) - LIVE_FOR))


@pytest.mark.parametrize("bad", [picture(1.0, fps=3.0), picture(1.0, quality=0.3), picture(1.0, quality=None)])
def test_a_poor_picture_is_no_video(bad: VideoStatus) -> None:
    meter = airborne()
    meter.video(bad)
    assert meter.cost.unseen is None


def test_at_home_and_on_the_ground_nobody_needs_video() -> None:
    meter = airborne()
    meter.video(picture(0.0))
    meter.truth(truth(10.0, (AWAY / 2, 0.0, 5.0)))
    meter.truth(truth(20.0, (AWAY / 2, 0.0, 5.0)))
    meter.flight(FlightState(t=20.0, on_ground=True, rotors_on=False, home_valid=True, authority=True))
    meter.truth(truth(30.0, (2 * AWAY, 0.0, 0.0)))
    assert meter.cost.unseen == 0.0


def test_the_circle_is_that_of_the_site() -> None:
    plan = plan_of("inspection", "nominal", 0)
    target = plan.site().target
    assert target is not None
    circle = planned_circle(plan.site(), "inspection")
    assert all(math.dist(corner[:2], target.centre) == pytest.approx(target.radius) for corner in circle)
    assert planned_circle(plan.site(), "mapping") == ()


# --- what the page says ----------------------------------------------------------------------------------------------


def flown(mission: str, label: str, seed: int, **figures: object) -> FlightResult:
    result = FlightResult(
        plan=plan_of(mission, label, seed),
        end=End.HOME,
        phase="SUCCEEDED",
        coverage=0.8,
        clearance=2.0,
        end_time=100.0,
        cost=Cost(charge=10.0, circled=1.0, circled_live=0.5, unseen=4.0),
    )
    return replace(result, **figures)


def test_the_cost_of_recovery_is_its_difference_to_the_other_flights_of_the_same_seed() -> None:
    results = [
        flown("mapping", "nominal", 0),
        flown("mapping", "nominal", 1, coverage=0.6, end_time=200.0),
        flown("mapping", "recovery", 0, coverage=0.75, end_time=110.0, cost=Cost(charge=12.0)),
        flown("mapping", "recovery", 1, coverage=0.5, end_time=200.0, cost=Cost(charge=11.0)),
        flown("mapping", "none", 1, coverage=0.25, end_time=50.0, cost=Cost(charge=5.5), collisions=1),
    ]
    lines = page.tables(results, PLANS, "c0de").splitlines()
    assert lines[0].startswith("5 of 20 flights, of seeds 0, 1, all by the same flight code, c0de")
    first = next(number for number, line in enumerate(lines) if line.startswith("| recovery, against"))
    assert lines[first + 2 : first + 4] == [
        "| nominal | -8 points (-10 to -5) | +5 % (+0 to +10) | +15 % (+10 to +20) |",
        "| none: on, blind (1 of 1 crashed) | +25 points | +300 % | +100 % |",
    ]


def test_what_was_hit_is_said() -> None:
    results = [flown("mapping", "nominal", 0), flown("mapping", "none", 0, collisions=2, phase="FAILED", coverage=None)]
    text = page.tables(results, PLANS, "c0de")
    assert "no map, 2 collisions" in text
    row = next(line for line in text.splitlines() if line.startswith("| none: on, blind | 1 |"))
    assert row.startswith("| none: on, blind | 1 | 0 | 1 | 1 crashed | - |")


def test_what_was_flown_without_video_is_the_circle_that_was_not_seen() -> None:
    cost = Cost(charge=10.0, circled=0.75, circled_live=0.5, unseen=4.0)
    text = page.tables([flown("inspection", "recovery", 0, cost=cost)], PLANS, "c0de")
    row = next(line for line in text.splitlines() if line.startswith("| recovery"))
    assert "| 75 % |" in row
    assert row.endswith("| 25 % | 4 s |")


@pytest.mark.parametrize("mission", ["mapping", "inspection"])
def test_without_another_flight_recovery_has_no_cost(mission: str) -> None:
    assert "Nothing to compare recovery with." in page.tables([flown(mission, "recovery", 0)], PLANS, "c0de")


def test_nothing_is_said_to_be_less_than_zero_that_is_rounded_to_it() -> None:
    assert page.POINTS.show(-0.001) == "+0 points"


def test_writing_keeps_what_stands_around_the_tables(tmp_path: Path) -> None:
    file = tmp_path / "results.md"
    file.write_text(f"before\n{page.MARKS.begin}\n{page.MARKS.end}\nafter\n", encoding="utf-8")
    results = [flown("mapping", "nominal", 0), flown("inspection", "nominal", 0)]
    plans = [each.plan for each in results]
    page.write_page(file, results[:1], plans, "c0de", set())
    assert "1 of 2 flights" in file.read_text(encoding="utf-8")
    page.write_page(file, results, plans, "c0de", set())
    text = file.read_text(encoding="utf-8")
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    assert "2 of 2 flights" in text
    assert "1 of 2 flights" not in text


def test_flights_that_are_missing_are_named() -> None:
    results = [flown(plan.mission, plan.label, plan.seed) for plan in PLANS]
    assert "Not in these tables" not in page.tables(results, PLANS, "c0de")
    mapped = [each for each in results if each.plan.mission == "mapping" and each.plan.name != results[1].plan.name]
    assert (
        "**Not in these tables, for it has not been flown by this code: "
        "mapping, recovery, seed 0; inspection, every policy, seeds 0, 1.**"
    ) in page.tables(mapped, PLANS, "c0de")


def test_pictures_of_other_flights_than_those_of_the_tables_are_named(tmp_path: Path) -> None:
    file = tmp_path / "results.md"
    pictures = "![One](images/results/one.png)\n![Two](images/results/two.png)\n"
    file.write_text(f"{page.MARKS.begin}\n{page.MARKS.end}\n{pictures}", encoding="utf-8")
    results = [flown("mapping", "nominal", 0)]
    page.write_page(file, results, PLANS, "c0de", {"one.png"})
    assert "by other code: `two.png`.**" in file.read_text(encoding="utf-8")
    page.write_page(file, results, PLANS, "c0de", {"one.png", "two.png"})
    assert "by other code" not in file.read_text(encoding="utf-8")


def test_a_cell_tells_of_how_many_flights_it_is() -> None:
    results = [flown("mapping", "nominal", 0), flown("mapping", "nominal", 1, coverage=None)]
    assert "| 80 %, 1 of 2 known |" in page.tables(results, PLANS, "c0de")


def test_the_picture_has_a_row_of_panels_for_each_mission_that_was_flown(tmp_path: Path) -> None:
    one, both = tmp_path / "one.png", tmp_path / "both.png"
    mapping = [flown("mapping", "nominal", 0), flown("mapping", "none", 0, collisions=1, coverage=None)]
    pictures.draw_costs(one, mapping)
    pictures.draw_costs(both, [*mapping, flown("inspection", "recovery", 0)])
    assert imread(both).shape[0] > 1.5 * imread(one).shape[0]


def test_the_way_is_drawn_in_the_colours_of_its_link(tmp_path: Path) -> None:
    plan = plan_of("inspection", "recovery", 0)
    circle = planned_circle(plan.site(), "inspection")
    flight, timeline = JsonLines[Truth](tmp_path / FLIGHT_FILE), JsonLines[Record](tmp_path / TIMELINE_FILE)
    for t, place in enumerate(circle[:20]):
        flight.write(truth(float(t), place))
    for number, (t, before, after) in enumerate([(0.0, "UNKNOWN", "GOOD"), (10.0, "GOOD", "LOST")]):
        kind = RecordKind.RESOURCE
        change = Record(id=str(number), t=t, source="s", kind=kind, subject=ways.LINK, before=before, after=after)
        timeline.write(change)
    flight.close()
    timeline.close()
    ways.draw_ways(tmp_path / "ways.png", plan, {"recovery": tmp_path})
    picture = imread(tmp_path / "ways.png")[:, :, :3]

    def pixels(state: str) -> int:
        return int((np.abs(picture - to_rgb(ways.COLOURS[state])).max(axis=2) < 0.02).sum())

    legend = pixels("DEGRADED")
    assert pixels("GOOD") > 3 * legend
    assert pixels("LOST") > 3 * legend


def test_a_plan_flies_the_alternative_of_the_package_wherever_that_lies() -> None:
    alternatives = [plan for plan in PLANS if plan.alternative]
    assert alternatives
    for plan in alternatives:
        assert Path(plan.flown).is_file()
        assert replace(plan, alternative=False).flown == plan.mission
        assert str(Path(plan.flown).parent) not in msgspec.json.encode(plan).decode()
