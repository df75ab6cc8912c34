"""`skillwing world`: descriptions, scenes and pictures of worlds."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import mujoco
import numpy as np
import pytest
from typer import Typer
from typer.testing import CliRunner

from skillwing.sim_mujoco.world import picture
from skillwing.sim_mujoco.world.command import world
from skillwing.sim_mujoco.world.kinds import KINDS, make_site
from skillwing.sim_mujoco.world.rendering import Renderer, from_above, from_place
from skillwing.sim_mujoco.world.site import Site
from skillwing.sim_mujoco.world.world import make_world

app = Typer()
app.command()(world)


def run(*words: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, words)
    return result.exit_code, " ".join(result.output.replace("│", " ").split())


def test_without_a_kind_it_lists_those_there_are() -> None:
    code, text = run()
    assert code == 0
    assert all(kind in text for kind in KINDS)
    code, text = run("--json")
    assert [each["kind"] for each in json.loads(text)] == list(KINDS)


def test_a_site_is_printed_for_people_and_programs() -> None:
    code, text = run("inspection", "--seed", "3")
    assert code == 0
    assert "home over everything at 30.5 m" in text
    assert "circle of" in text
    code, text = run("village", "--seed", "3", "--scale", "0.9", "--json")
    assert code == 0
    assert msgspec.json.decode(text, type=Site) == make_site(3, "village", 0.9)


@pytest.mark.parametrize("kind", ["courtyard", "industrial"])
def test_scenes_load_into_plain_mujoco(kind: str, tmp_path: Path) -> None:
    file = tmp_path / "world.xml"
    assert run(kind, "--seed", "2", "-o", str(file)) == (0, f"{file} written.")
    loaded, ours = mujoco.MjModel.from_xml_path(str(file)), make_world(2, kind).spec().compile()
    assert loaded.ngeom == ours.ngeom > 30
    assert np.allclose(loaded.geom_pos, ours.geom_pos, atol=1e-3)
    assert np.allclose(loaded.hfield_data, ours.hfield_data, atol=1e-3)
    mujoco.mj_step(loaded, mujoco.MjData(loaded))


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("moon",), "there is no world of kind `moon`. Choose courtyard,"),
        (("village", "--scale", "9"), "a village has a scale between 0.8 and 2.5."),
        (("courtyard", "--scale", "2"), "a courtyard has a scale of 1 only."),
        (("street", "--scale", "nan"), "a street has a scale between"),
        (("village", "-o", "village.pdf"), "neither a scene nor a picture."),
        (("-o", "village.png"), "Name a KIND"),
        (("--scale", "1"), "Name a KIND"),
        (("--seed", "1"), "Name a KIND"),
        (("village", "--seed", "-1"), "-1 is not in the range 0<=x<=4294967295."),
    ],
)
def test_mistakes_get_a_sentence(words: tuple[str, ...], sentence: str) -> None:
    code, text = run(*words)
    assert code == 2
    assert sentence in text


def test_pictures_show_ground_sky_and_shadow() -> None:
    renderer = Renderer(make_world(1))
    above = renderer.picture(from_above((-5.0, -5.0), (45.0, 35.0), 100.0, 80), samples=1)
    assert above.shape == (80, 100, 3)
    grass = above[60, 5].astype(int)
    assert grass[1] > grass[0] > grass[2]
    # The large building inside the route throws its shadow to the north-east.
    assert above[80 - 36].astype(int).sum(axis=1).min() < 0.6 * grass.sum()
    aside = renderer.picture(from_place((-20.0, -20.0, 8.0), (15.0, 10.0, 3.0), (40, 60), 60.0), samples=1)
    assert aside[0].mean(axis=0)[2] > 200
    assert aside[-1].mean(axis=0)[2] < 130


def test_a_picture_is_written(tmp_path: Path) -> None:
    file = tmp_path / "inspection.png"
    picture.draw_world(file, make_world(1, "inspection"), rows=40)
    assert file.read_bytes().startswith(b"\x89PNG")
