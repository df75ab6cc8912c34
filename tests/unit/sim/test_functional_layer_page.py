"""The table of topics is complete, the page is made from it, and what the page says in prose is so."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from skillwing.m600.bridge.levels import CRITICAL_BELOW, DEGRADED_BELOW, HYSTERESIS, LOST_BELOW, LOW_BELOW, SILENCE
from skillwing.m600.bridge.node import FLIGHT_SILENCE, RESEND_PERIOD
from skillwing.m600.robot import ROBOT
from skillwing.m600.skills import depthmap, guidance_client, lidar_mapping, stream, takeoff
from skillwing.onboard import topics
from skillwing.onboard.guidance import body_motion
from skillwing.onboard.interface.page import TEMPLATE, interface_page, interface_schema
from skillwing.onboard.interface.table import TOPICS
from skillwing.services.protocol import CLOCK_KEY, Message
from skillwing.services.terminal.cli import app
from skillwing.services.wire.channel import Channel, Kind

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "functional-layer.md").read_text(encoding="utf-8")
SKILLSET = ROBOT.load_skillset()


def test_the_page_is_what_the_code_says() -> None:
    assert interface_page() == PAGE, "run `make generate`"


def defined() -> Iterator[tuple[str, Any]]:
    """All names that the modules of topics define or import."""
    for module in iter_modules(topics.__path__, "skillwing.onboard.topics."):
        yield from vars(import_module(module.name)).items()


def test_every_key_is_in_the_table_once() -> None:
    texts = {value for name, value in defined() if name.isupper() and isinstance(value, str)}
    spelt = {CLOCK_KEY, *(text for text in texts if text.startswith("fl/"))}
    assert sorted(topic.key for topic in TOPICS) == sorted(spelt)


def test_every_message_is_on_the_page() -> None:
    messages = {
        name
        for name, value in defined()
        if isinstance(value, type) and issubclass(value, Message) and value is not Message
    }
    assert {name for name in messages if f"\n### {name}\n" not in PAGE} == set()


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.key)
def test_a_row_says_what_its_kind_calls_for(topic: Channel) -> None:
    query = topic.kind is Kind.QUERY
    assert (topic.reply is not None) == query
    assert bool(topic.array) or topic.kind is not Kind.ARRAYS
    assert query or not topic.refusals
    assert query == (topic.rate is None and not topic.when)
    meaning = TEMPLATE.meaning(topic)
    assert meaning.text.endswith(".") and meaning.without.endswith(".")


@pytest.mark.parametrize(
    "sentence",
    [
        f"LOW below {LOW_BELOW:g} %, CRITICAL below {CRITICAL_BELOW:g} %, better with {HYSTERESIS:g} % more",
        f"DEGRADED below {DEGRADED_BELOW:g} Mbit/s, LOST below {LOST_BELOW:g}",
        f"silent for {SILENCE:g} s is LOST",
        f"UNAVAILABLE also after {FLIGHT_SILENCE:g} s of silence",
        f"elsewhere comes back within {RESEND_PERIOD:g} s",
        f"stamped less than {guidance_client.UNDER_WAY:g} s after its command was taken",
        f"After {guidance_client.SILENCE_LIMIT:g} s a goal that flies fails",
        f"ends NO_DATA after {depthmap.PATIENCE:g} s",
        f"`lidar_mapping` fails after {lidar_mapping.PATIENCE:g} s",
        f"`stream` fails after {stream.PATIENCE:g} s",
        f"({takeoff.TOLERANCE:g} m), straight above where it stood ({takeoff.MAX_DRIFT:g} m)",
        f"{body_motion.MAX_CLIMB:g} m/s up and down",
        f"Stay within {body_motion.DRIFT:g} m of the path",
        f"Come to rest ({body_motion.AT_REST:g} m/s) within {body_motion.ARRIVED_WITHIN:g} m of its end",
        f"or it is BLOCKED {body_motion.PATIENCE:g} s later",
        f"ends BLOCKED after {body_motion.PATIENCE:g} s",
        f"at {body_motion.TOUCHDOWN_SPEED:g} m/s below {body_motion.FLARE_HEIGHT:g} m",
        f"before the path is {body_motion.DRIFT:g} m below the vehicle",
        f"It lands slowly all the way, at {body_motion.TOUCHDOWN_SPEED:g} m/s at most",
    ],
)
def test_figures_are_those_of_guidance_and_of_others_who_use_it(sentence: str) -> None:
    assert sentence in " ".join(PAGE.split())


def test_everything_that_the_robot_gets_from_outside_is_accounted_for() -> None:
    above = PAGE.partition("## What becomes of it above")[2].partition("\n## ")[0]
    extern = {
        resource.name
        for resource in SKILLSET.resources
        if any(transition.extern for transition in resource.transitions)
    }
    untold = {name for name in (*extern, *(datum.name for datum in SKILLSET.data)) if f"`{name}`" not in above}
    assert untold == {"slam_status"}, "told by a skill's manager, not by the bridge"


# --- frames ----------------------------------------------------------------------------------------------------------

FORMULAS: dict[str, Any] = {}
exec(re.search(r"```py\n(.*?)```", PAGE, re.DOTALL)[1], FORMULAS)  # type: ignore[index]
NUMBERS = st.floats(-100.0, 100.0)
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


@given(st.tuples(*[st.floats(0.1, 1.0)] * 2, *[st.floats(-1.0, 1.0)] * 2), VECTORS)
def test_an_attitude_turns_the_same_vector_into_the_same_vector(
    parts: tuple[float, ...], seen: tuple[float, ...]
) -> None:
    w, x, y, z = (part / math.hypot(*parts) for part in parts)
    in_ned = Rotation.from_quat([x, y, z, w]).apply(seen)
    a, b, c, d = FORMULAS["attitude"](w, x, y, z)
    in_enu = Rotation.from_quat([b, c, d, a]).apply(FORMULAS["flu"](seen))
    assert np.allclose(in_enu, FORMULAS["enu"](in_ned), atol=1e-9)


@given(st.floats(-7.0, 7.0))
def test_a_heading_is_where_the_nose_points(from_north: float) -> None:
    nose = FORMULAS["enu"]((math.cos(from_north), math.sin(from_north), 0.0))
    heading = FORMULAS["heading"](from_north)
    assert (math.cos(heading), math.sin(heading)) == pytest.approx(nose[:2], abs=1e-9)
    level = FORMULAS["attitude"](math.cos(from_north / 2.0), 0.0, 0.0, math.sin(from_north / 2.0))
    assert abs(math.remainder(2.0 * math.atan2(level[3], level[0]) - heading, math.tau)) < 1e-9


# --- for programs ----------------------------------------------------------------------------------------------------


def test_the_command_prints_page_and_schema() -> None:
    run = CliRunner()
    assert run.invoke(app, ["functional-layer"]).stdout == PAGE
    printed = json.loads(run.invoke(app, ["functional-layer", "--json-schema"]).stdout)
    assert printed == json.loads(json.dumps(interface_schema()))
    rows = {row["key"]: row for row in printed["topics"]}
    assert rows["fl/navigation"]["rate"] == 50.0
    assert rows["fl/guidance/command"]["refusals"][0] == "BAD_REQUEST"
    assert {row["message"] for row in rows.values()} <= printed["$defs"].keys()
