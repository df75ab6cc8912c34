"""The one mission of a robot: requests, repetitions, refusals, and the ends of its process."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.services.core.refusal import RefusedError
from skillwing.services.processes.mission_slot import MOST_OPTIONS, MissionSlot
from skillwing.services.protocol import ErrorCode, MissionPhase, MissionStatus, StartMission


def request(request_id: str = "1", mission: str = "patrol", **fields: Any) -> StartMission:
    return StartMission(request_id=request_id, mission=mission, client="cli", **fields)


def status(phase: MissionPhase, mission: str = "patrol", request_id: str = "1") -> MissionStatus:
    """Status of a mission on board by default; request_id is empty for one on the ground."""
    return MissionStatus(mission=mission, phase=phase, t=1.0, text="", request_id=request_id)


def on_the_ground(phase: MissionPhase, mission: str = "mapping") -> MissionStatus:
    return status(phase, mission, "")


def refusal(slot: MissionSlot, asked: StartMission) -> RefusedError:
    with pytest.raises(RefusedError) as refused:
        slot.request(asked, 1.0)
    return refused.value


def running(mission: str = "patrol") -> MissionSlot:
    slot = MissionSlot()
    assert slot.request(request(mission=mission), 1.0) is None
    slot.appeared()
    slot.note(status(MissionPhase.IDLE, mission))
    return slot


def test_a_request_starts_its_mission_once_and_is_answered_when_it_runs() -> None:
    slot = MissionSlot()
    assert slot.request(request(), 1.0) is None
    assert refusal(slot, request()).code is ErrorCode.UNAVAILABLE
    slot.appeared()
    assert refusal(slot, request()).code is ErrorCode.UNAVAILABLE, "the token may be that of another mission"
    slot.note(status(MissionPhase.IDLE))
    answer = slot.request(request(), 1.0)
    assert answer is not None
    assert (answer.mission, answer.phase, answer.text) == ("patrol", MissionPhase.IDLE, "it runs on board")
    assert answer.request_id == "1"
    slot.note(status(MissionPhase.SUCCEEDED))
    assert slot.request(request(), 1.0) == answer


def test_a_second_mission_is_refused_with_the_name_of_the_first() -> None:
    for slot in (running(), MissionSlot()):
        slot.request(request(), 1.0)
        refused = refusal(slot, request("2", "inspection"))
        assert refused.code is ErrorCode.NOT_ALLOWED
        assert refused.message == "Mission patrol runs here already."


def test_an_objection_refuses_new_missions_and_not_the_answer_to_an_earlier_request() -> None:
    objection = RefusedError(ErrorCode.NOT_ALLOWED, "A certificate ends.")
    slot = MissionSlot()
    with pytest.raises(RefusedError, match="A certificate ends"):
        slot.request(request(), 1.0, objection)
    assert slot.request(request("2"), 1.0) is None, "the place is free"
    slot.note(status(MissionPhase.IDLE, request_id="2"))
    answer = slot.request(request("2"), 2.0, objection)
    assert answer is not None
    assert answer.request_id == "2"


def test_a_mission_on_the_ground_counts_as_well() -> None:
    slot = MissionSlot()
    slot.appeared()
    assert refusal(slot, request("0")).message == "A mission runs here already."
    slot.note(on_the_ground(MissionPhase.RUNNING))
    assert refusal(slot, request("1")).message == "Mission mapping runs here already."
    slot.vanished()
    assert slot.request(request("2"), 1.0) is None


def test_a_process_that_ends_before_its_mission_began_refuses_the_request_with_its_last_lines() -> None:
    slot = MissionSlot()
    slot.request(request(), 1.0)
    assert slot.exited("", ("There is no skill `fly`.", "There is no skill `dive`."), does_not_fit=True)
    refused = refusal(slot, request())
    assert refused.code is ErrorCode.BAD_REQUEST
    lines = ["Mission `patrol` did not start.", "There is no skill `fly`.", "There is no skill `dive`."]
    assert refused.message.splitlines() == lines
    assert slot.request(request("2"), 1.0) is None, "the place is free"


def test_a_process_that_crashes_before_its_mission_began_says_how() -> None:
    slot = MissionSlot()
    slot.request(request(), 1.0)
    assert slot.exited("mission was killed by SIGKILL.", ())
    refused = refusal(slot, request())
    assert refused.code is ErrorCode.NOT_ALLOWED
    assert refused.message == "Mission `patrol` did not start. mission was killed by SIGKILL."
    assert "logs of the run" in refused.help


def test_a_mission_whose_process_dies_is_over_and_says_why() -> None:
    slot = running()
    slot.note(status(MissionPhase.RUNNING))
    assert not slot.exited("mission was killed by SIGKILL.", ())
    last = slot.cut_short("its process has ended", 9.0)
    assert last is not None
    assert (last.phase, last.text, last.t) == (MissionPhase.ABORTED, "its process has ended", 9.0)
    assert slot.status == last
    assert slot.cut_short("its process has ended", 9.0) is None


def test_a_mission_that_has_ended_by_itself_is_not_cut_short() -> None:
    slot = running()
    slot.note(status(MissionPhase.SUCCEEDED))
    slot.exited("", ())
    assert slot.cut_short("its process has ended", 9.0) is None
    slot.vanished()
    assert slot.request(request("2"), 1.0) is None


def test_a_mission_on_the_ground_that_begins_at_the_same_moment_answers_no_request() -> None:
    slot = MissionSlot()
    assert slot.request(request(), 1.0) is None
    slot.appeared()
    slot.note(on_the_ground(MissionPhase.RUNNING))
    assert refusal(slot, request()).code is ErrorCode.UNAVAILABLE
    slot.note(status(MissionPhase.RUNNING))
    slot.note(on_the_ground(MissionPhase.FAILED))
    assert slot.latest() == slot.latest("1") == status(MissionPhase.RUNNING)
    assert slot.exited("mission was killed by SIGKILL.", ()) is False
    cut_short = slot.cut_short("its process has ended", 9.0)
    assert cut_short is not None
    assert cut_short.request_id == "1"
    slot.note(on_the_ground(MissionPhase.SUCCEEDED))
    assert slot.latest() == on_the_ground(MissionPhase.SUCCEEDED)
    assert slot.latest("1") == cut_short


def test_only_a_mission_whose_process_runs_here_is_on_board() -> None:
    """The launcher of another robot may have run the mission, and died with it."""
    slot = MissionSlot()
    slot.note(status(MissionPhase.RUNNING, "both", "of another launcher"))
    slot.vanished()
    with pytest.raises(RefusedError, match="No mission runs on board here"):
        slot.on_board()
    slot.request(request(), 1.0)
    assert slot.on_board().mission == "patrol"
    slot.note(status(MissionPhase.RUNNING))
    assert slot.on_board() == status(MissionPhase.RUNNING)
    slot.exited("", ())
    with pytest.raises(RefusedError, match="No mission runs on board here"):
        slot.on_board()


def test_a_refusal_is_not_lost_beside_a_mission_on_the_ground() -> None:
    slot = MissionSlot()
    slot.request(request(), 1.0)
    slot.appeared()
    slot.note(on_the_ground(MissionPhase.RUNNING))
    assert slot.exited("", ("There is no skill `fly`.",))
    assert refusal(slot, request()).message.endswith("There is no skill `fly`.")


def test_the_status_of_a_mission_is_known_when_another_one_has_run_since() -> None:
    slot = running()
    slot.note(status(MissionPhase.FAILED))
    slot.exited("", ())
    slot.vanished()
    assert slot.request(request("2", "inspection"), 2.0) is None
    slot.note(status(MissionPhase.SUCCEEDED, "inspection", "2"))
    assert slot.latest("1").phase is MissionPhase.FAILED
    assert slot.latest().mission == "inspection"
    with pytest.raises(RefusedError, match="This launcher does not know that mission"):
        slot.latest("3")
    with pytest.raises(RefusedError, match="No mission has run here yet"):
        MissionSlot().latest()


def test_a_mission_that_is_over_before_its_token_is_seen_keeps_its_last_status() -> None:
    slot = MissionSlot()
    slot.note(on_the_ground(MissionPhase.SUCCEEDED, "before"))
    slot.request(request(), 1.0)
    assert slot.status is not None
    assert slot.status.phase is MissionPhase.IDLE, "of this mission, not of the one before"
    slot.note(status(MissionPhase.FAILED))
    slot.appeared()
    assert slot.status == status(MissionPhase.FAILED)


def test_a_request_that_is_refused_leaves_the_status_of_the_mission_before() -> None:
    slot = MissionSlot()
    slot.note(on_the_ground(MissionPhase.SUCCEEDED, "before"))
    slot.request(request(), 1.0)
    slot.exited("", ())
    assert slot.status == on_the_ground(MissionPhase.SUCCEEDED, "before")


@pytest.mark.parametrize("name", ["patrol.py", "patrol.xml", "../patrol", "a b", "", "-x", "patrol\n"])
def test_files_of_the_robot_cannot_be_named(name: str) -> None:
    refused = refusal(MissionSlot(), request(mission=name))
    assert refused.code is ErrorCode.BAD_REQUEST
    assert "Install a mission in Python on the robot" in refused.help


@pytest.mark.parametrize("options", [{"a": "x" * MOST_OPTIONS}, {"a": b"bytes"}])
def test_options_that_fit_no_command_line_are_refused(options: dict[str, Any]) -> None:
    assert refusal(MissionSlot(), request(options=options)).code is ErrorCode.BAD_REQUEST


ACTS = st.sampled_from(["ask 1", "ask 2", "ask 3", "appear", "vanish", "begin", "ground", "exit"])


@given(st.lists(ACTS, max_size=30))
def test_at_most_one_mission_is_started_at_a_time_and_a_request_starts_one_once(acts: list[str]) -> None:
    slot = MissionSlot()
    started: list[str] = []
    runs = present = False
    for act in acts:
        match act.split():
            case ["ask", number]:
                try:
                    reply = slot.request(request(number), 1.0)
                    starts = reply is None
                    assert reply is None or reply.request_id == number, "the answer is that of this request"
                except RefusedError:
                    starts = False
                if starts:
                    assert not runs
                    assert not present
                    assert number not in started
                    started.append(number)
                    runs = True
            case ["appear"]:
                slot.appeared()
                present = True
            case ["vanish"]:
                slot.vanished()
                present = False
            case ["begin"] if runs:
                slot.note(status(MissionPhase.RUNNING, request_id=started[-1]))
            case ["begin"]:
                pass
            case ["ground"]:
                slot.note(on_the_ground(MissionPhase.RUNNING))
            case _:
                slot.exited("It ended.", ())
                runs = False
