"""Pictures say what the model says, are placed legibly, and are the same each time."""

from __future__ import annotations

import sys
from itertools import combinations
from math import hypot
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import pytest
import typer
from command_runner import CommandRunner
from pygraphviz import AGraph

from skillwing import m600
from skillwing.dsl import UnknownNameError, load, parse
from skillwing.dsl.commands.graph import graph
from skillwing.dsl.printing.pictures.diagram import Arrow, Diagram, DiagramNode
from skillwing.dsl.printing.pictures.dot import to_dot
from skillwing.dsl.printing.pictures.mermaid import to_mermaid
from skillwing.dsl.printing.pictures.placement import ARROW_TEXT, LINE_HEIGHT, NODE_TEXT, place, text_width
from skillwing.dsl.printing.pictures.subjects import map_diagram, resource_diagram, skill_diagram
from skillwing.dsl.printing.pictures.svg import to_svg

M600 = Path(m600.__path__[0]) / "m600.skillset"
EXAMPLES = sorted((Path(__file__).parents[3] / "examples").glob("*/*.skillset"))
EVERYTHING = Path(__file__).parent / "cases" / "valid" / "everything.skillset"


def pictures(path: Path) -> list[Diagram]:
    skillset = load(path)
    machines = [*map(resource_diagram, skillset.resources), *map(skill_diagram, skillset.skills)]
    return [map_diagram(skillset), *machines]


DIAGRAMS = [diagram for path in (M600, *EXAMPLES, EVERYTHING) for diagram in pictures(path)]
by_title = pytest.mark.parametrize("diagram", DIAGRAMS, ids=lambda diagram: diagram.title)


# --- what they show


def test_a_resource_is_drawn_as_the_paper_does() -> None:
    diagram = resource_diagram(load(M600).resource("slam_status"))
    assert [node.label for node in diagram.nodes] == ["", "IDLE", "RUNNING", "DIVERGED"]
    start = diagram.nodes[0].id
    assert [(arrow.source, arrow.target, arrow.dashed) for arrow in diagram.arrows] == [
        (start, "IDLE", False),
        ("IDLE", "RUNNING", False),
        ("RUNNING", "IDLE", False),
        ("RUNNING", "DIVERGED", True),
        ("DIVERGED", "IDLE", False),
    ]
    assert "extern" in diagram.legend
    assert resource_diagram(load(M600).resource("axes_authority")).legend == ""


def test_the_map_has_what_touches_nothing() -> None:
    skillset = parse("skillset s { resource r { initial A  A -> B } skill wait { result { success OVER } } }")
    diagram = map_diagram(skillset)
    assert [node.label for node in diagram.nodes] == ["wait", "r"]
    assert diagram.arrows == ()


def test_a_skill_is_drawn_with_its_own_names() -> None:
    diagram = skill_diagram(load(EVERYTHING).skill("move"))
    written = {(arrow.target): arrow.lines for arrow in diagram.arrows}
    kinds = {node.label: node.kind for node in diagram.nodes if node.is_terminal}
    assert kinds == {
        **dict.fromkeys(["NV", "NR", "N_...", "RI", "ERROR", "LOST", "IT"], "ending"),
        "S_ARRIVED": "success",
        "S_LATE": "failure",
        "S_NOWHERE": "failure",
    }
    assert written["DISPATCHING"] == ("free", "ready", "source", "charged", "mode / take")
    assert written["NR"] == ("not all hold / nothing",)
    assert written["S_ARRIVED"] == ("ARRIVED / release", "post axes == FREE and source == NONE")
    assert written["RI"] == ("not mine / release", "not charged / release", "not still / release")
    assert written["INTERRUPTING"] == ("interrupt", "or 60 s are over")
    assert written["IT"] == ("stopped,", "or 2 s later / release")


def test_a_skill_without_guards_and_effects_has_only_the_endings_it_can_reach() -> None:
    skill = parse("skillset s { skill k { result { DONE } } }").skill("k")
    endings = [node.label for node in skill_diagram(skill).nodes if node.is_terminal]
    assert endings == ["NV", "S_DONE", "ERROR", "LOST", "IT"]


def test_the_map_tells_changes_from_questions() -> None:
    arrows = {(arrow.source, arrow.target): arrow.dashed for arrow in map_diagram(load(M600)).arrows}
    assert arrows["skill zed_depthmap", "resource depthmap_source"] is False
    assert arrows["skill zed_depthmap", "resource zed_status"] is True
    assert ("skill zed_depthmap", "resource axes_authority") not in arrows


# --- how they are placed


class Box(NamedTuple):
    left: float
    top: float
    right: float
    bottom: float

    def overlaps(self, other: Box) -> bool:
        across = self.left < other.right and other.left < self.right
        return across and self.top < other.bottom and other.top < self.bottom


def around(center: tuple[float, float], width: float, height: float) -> Box:
    return Box(center[0] - width / 2, center[1] - height / 2, center[0] + width / 2, center[1] + height / 2)


@by_title
def test_nothing_overlaps_and_everything_is_in_the_picture(diagram: Diagram) -> None:
    placement = place(diagram)
    nodes = [around(node.center, node.width, node.height) for node in placement.nodes]
    labels = [
        around(
            arrow.label,
            max(text_width(line, ARROW_TEXT) for line in arrow.arrow.lines),
            ARROW_TEXT * LINE_HEIGHT * len(arrow.arrow.lines),
        )
        for arrow in placement.arrows
        if arrow.label is not None
    ]
    assert len(labels) == sum(bool(arrow.lines) for arrow in diagram.arrows)
    assert not [pair for pair in combinations([*nodes, *labels], 2) if pair[0].overlaps(pair[1])]
    for box in (*nodes, *labels):
        assert box.left >= -1 and box.top >= -1
        assert box.right <= placement.width + 1 and box.bottom <= placement.height + 1
    for node in placement.nodes:
        assert text_width(node.node.label, NODE_TEXT) < node.width or node.node.kind == "start"


@by_title
def test_every_arrow_ends_at_the_outline_of_its_node(diagram: Diagram) -> None:
    placement = place(diagram)
    nodes = {placed.node.id: placed for placed in placement.nodes}
    for arrow in placement.arrows:
        for at, node in ((arrow.curve[0], nodes[arrow.arrow.source]), (arrow.tip, nodes[arrow.arrow.target])):
            across = abs(at[0] - node.center[0]) / (node.width / 2)
            down = abs(at[1] - node.center[1]) / (node.height / 2)
            is_round = node.node.kind in {"start", "resource"}
            reach = hypot(across, down) if is_round else max(across, down)
            assert reach == pytest.approx(1, abs=0.3 if node.node.kind == "start" else 0.15)


# --- how they are written


@by_title
def test_svg_is_well_formed_complete_and_deterministic(diagram: Diagram) -> None:
    svg = to_svg(diagram)
    assert svg == to_svg(diagram)
    texts = [element.text for element in ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}text")]
    lines = [line for arrow in diagram.arrows for line in arrow.lines]
    expected = [diagram.title, diagram.legend, *(node.label for node in diagram.nodes), *lines]
    assert sorted(filter(None, texts)) == sorted(filter(None, expected))
    assert svg.count("arrow dashed") == sum(arrow.dashed for arrow in diagram.arrows)


@by_title
def test_graphviz_reads_the_dot_text(diagram: Diagram) -> None:
    read = AGraph(string=to_dot(diagram))
    assert sorted(read.nodes()) == sorted(node.id for node in diagram.nodes)
    assert sorted(read.edges()) == sorted((arrow.source, arrow.target) for arrow in diagram.arrows)


NASTY = Diagram(
    title='a <b> & "c" \\',
    nodes=(DiagramNode("x", 'say "<&>" #1', "state"), DiagramNode("end", "end", "resource")),
    arrows=(Arrow("x", "end", ('p == "a\\n"', "a < b")), Arrow("x", "x", dashed=True)),
    legend="<script>",
)


def test_what_is_written_is_escaped() -> None:
    texts = [element.text for element in ElementTree.fromstring(to_svg(NASTY)).iter("{http://www.w3.org/2000/svg}text")]
    assert {NASTY.title, NASTY.legend, 'say "<&>" #1', 'p == "a\\n"', "a < b"} <= set(texts)
    read = AGraph(string=to_dot(NASTY))
    assert read.get_node("x").attr["label"] == 'say "<&>" #1'
    mermaid = to_mermaid(NASTY)
    assert 'n0(["say #quot;#lt;&#gt;#quot; #35;1"])' in mermaid
    assert 'n0 -- "p == #quot;a\\n#quot;<br>a #lt; b" --> n1' in mermaid
    assert "    n0 -.-> n0\n" in mermaid


# --- the command


@pytest.fixture
def app() -> typer.Typer:
    application = typer.Typer()
    application.command("graph")(graph)
    return application


def run(app: typer.Typer, *arguments: str) -> tuple[int, str, str]:
    result = CommandRunner().invoke(app, [str(M600), *arguments])
    return result.exit_code, result.stdout, result.stderr


def test_one_picture_goes_to_standard_output(app: typer.Typer) -> None:
    skillset = load(M600)
    assert run(app) == (0, to_svg(map_diagram(skillset)), "")
    resource = to_mermaid(resource_diagram(skillset.resource("zed_status")))
    assert run(app, "--resource", "zed_status", "--format", "mermaid") == (0, resource, "")


def test_the_extension_of_the_file_chooses_the_format(app: typer.Typer, tmp_path: Path) -> None:
    for name, printer in (("a.dot", to_dot), ("a.mmd", to_mermaid), ("a.svg", to_svg), ("a", to_svg)):
        assert run(app, "--skill", "land", "-o", str(tmp_path / name))[0] == 0
        assert (tmp_path / name).read_text() == printer(skill_diagram(load(M600).skill("land")))


def test_an_extension_that_cannot_be_written_is_refused(app: typer.Typer, tmp_path: Path) -> None:
    file = tmp_path / "map.png"
    code, _, error = run(app, "-o", str(file))
    assert (code, error) == (
        2,
        "`.png` cannot be written. Name a file in .svg, .dot, .gv, .mmd, or give `--format`.\n",
    )
    assert not file.exists()
    assert run(app, "-o", str(tmp_path / "map.txt"), "--format", "dot")[0] == 0


def test_all_pictures_fill_a_directory(app: typer.Typer, tmp_path: Path) -> None:
    code, output, _ = run(app, "--all", "--format", "dot", "-o", str(tmp_path / "pictures"))
    m600 = load(M600)
    count = 1 + len(m600.resources) + len(m600.skills)
    assert (code, output) == (0, f"{tmp_path / 'pictures'}: {count} pictures of `m600`.\n")
    names = {path.name for path in (tmp_path / "pictures").iterdir()}
    assert len(names) == count
    assert {"skillset.dot", "resource-zed_status.dot", "skill-takeoff.dot"} <= names


def test_misuse_is_said_in_a_sentence(app: typer.Typer, tmp_path: Path) -> None:
    assert run(app, "--all")[::2] == (
        2,
        "`--all` draws many pictures. Name a directory for them: `--all -o pictures`.\n",
    )
    assert run(app, "--all", "--skill", "land")[0] == 2
    assert run(app, "-o", str(tmp_path))[0] == 2
    with pytest.raises(UnknownNameError, match="did you mean `takeoff`"):
        CommandRunner().invoke(app, [str(M600), "--skill", "takeof"], catch_exceptions=False)


def test_without_graphviz_text_still_works(app: typer.Typer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygraphviz", None)
    code, output, error = run(app)
    assert (code, output) == (2, "")
    assert "Install `skillwing[pictures]`" in error
    assert run(app, "--format", "dot")[0] == 0
