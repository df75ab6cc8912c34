"""Reading mock scripts: what they say, and everything that is wrong in them at once."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.dsl import parse
from skillwing.m600.robot import ROBOT, SKILLSET
from skillwing.services.mocking import Choices, MockRun, ScriptError, load_script, load_scripts
from skillwing.services.mocking.fitting import problems_of
from skillwing.services.mocking.script_file import read_script

ARM = parse("""
skillset arm {
    data { load: float64 [kg] period=0.5 }
    resource power { initial ON  extern ON -> OFF  extern OFF -> ON }
    resource joints { initial FREE  FREE -> USED  USED -> FREE }
    event cut { guard resource=(power == ON) effect { power -> OFF } }
    skill reach {
        progress=0.5 { left: float64 [m] }
        input { distance: float64 [m] in 0.0..2.0  label: string }
        output { reached: float64 [m] in 0.0..2.0 }
        effect { take: joints -> USED  release: joints -> FREE }
        precondition { free: resource=(joints == FREE)  success take }
        result { success THERE: apply=release  failure STUCK: apply=release }
    }
}
""")

GOOD = """
seed = 7
[skill.reach]
choices = [{weight = 9}, {result = "STUCK", delay = [0.5, 2], output = {reached = {input = "distance"}}}]
[data]
load = {from = 0, to = 5, over = 10}
[resources]
power = "OFF"
[[reaction]]
when = {ends = "reach", with = ["STUCK", "RI"]}
after = 1
fire = "cut"
set = {load = {to = {input = "distance"}, over = 1}}
[[reaction]]
when = {resource = "power", becomes = "OFF"}
end = {reach = "STUCK"}
"""


def write(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "s.toml"
    file.write_text(text, encoding="utf-8")
    return file


def test_a_script_is_read(tmp_path: Path) -> None:
    script = load_script(write(tmp_path, GOOD), ARM)
    runs = script.skills["reach"]
    assert isinstance(runs, Choices)
    assert runs[0] == MockRun(weight=9.0)
    assert runs[1].delay == (0.5, 2.0)
    assert script.seed == 7
    assert [reaction.after for reaction in script.reactions] == [1.0, 0.0]
    assert script.reactions[0].when is not None
    assert script.reactions[0].when.ending == ("STUCK", "RI")


def test_one_run_needs_no_list(tmp_path: Path) -> None:
    script = load_script(write(tmp_path, "[skill.reach]\ndelay = 3\n"), ARM)
    assert script.skills["reach"] == (MockRun(delay=3.0),)


def test_an_empty_script_is_a_script(tmp_path: Path) -> None:
    assert load_script(write(tmp_path, ""), ARM).skills == {}


def test_scripts_add_to_one_another(tmp_path: Path) -> None:
    more = tmp_path / "more.toml"
    more.write_text('[skill.reach]\nforever = true\n[[reaction]]\nfire = "cut"\n', encoding="utf-8")
    script = load_scripts([write(tmp_path, GOOD), more], ARM)
    assert script.skills["reach"] == (MockRun(forever=True),)
    assert len(script.reactions) == 3
    assert (script.seed, script.resources) == (7, {"power": "OFF"})


@pytest.mark.parametrize("seed", [0, 5])
def test_the_later_seed_counts(tmp_path: Path, seed: int) -> None:
    more = tmp_path / "more.toml"
    more.write_text(f"seed = {seed}\n", encoding="utf-8")
    assert load_scripts([write(tmp_path, GOOD), more], ARM).seed == seed


PROBLEMS = [
    ("sed = 1", "There is no `sed` at the top; did you mean `seed`?"),
    ('seed = "x"', "it takes a whole number"),
    ("skill = 3", "it takes a table"),
    ("[skill.raech]", "did you mean `reach`?"),
    ("[skill.reach]\nruns = []", "takes a list of runs"),
    ("[skill.reach]\ndely = 1", "did you mean `delay`?"),
    ("[skill.reach]\ndelay = -1", "seconds from 0 on"),
    ("[skill.reach]\ndelay = nan", "seconds from 0 on"),
    ("[skill.reach]\ndelay = [2, 1]", "seconds from 0 on"),
    ('[skill.reach]\ndelay = "fast"', "seconds from 0 on"),
    ("[skill.reach]\ndelay = {input = 3}", '{input = "NAME"}'),
    ('[skill.reach]\ndelay = {inptu = "distance"}', '{input = "NAME"}'),
    ('[skill.reach]\ndelay = {input = "distnace"}', "skill.reach.delay takes the input `distnace`, which there is not"),
    ('[skill.reach]\ndelay = {input = "distnace"}', "did you mean `distance`?"),
    ('[skill.reach]\nruns = [{}, {delay = {input = "label"}}]', "skill.reach.runs[1].delay takes a finite number"),
    ('[skill.reach]\nstop_delay = "nevr"', 'or "never"'),
    ('[skill.reach]\nresult = "THEER"', "did you mean `THERE`?"),
    ('[skill.reach]\nresult = "THERE"\ncrash = true', "says `result` and `crash`"),
    ("[skill.reach]\noutput = {reached = 9.0}", "between 0 and 2 m"),
    ("[skill.reach]\noutput = {reched = 1.0}", "did you mean `reached`?"),
    ("[skill.reach]\nforever = true\noutput = {reached = 1.0}", "no result that it could go with"),
    ("[skill.reach]\nprogress = {lft = 1.0}", "did you mean `left`?"),
    ("[skill.reach]\ndelay = 1\nruns = [{}]", "both `runs` and `delay`"),
    ("[data]\nlaod = 1", "did you mean `load`?"),
    ('[data]\nload = {input = "distance"}', "there is no goal here"),
    ('[resources]\npower = "OF"', "did you mean `OFF`?"),
    ('[resources]\njoints = "USED"', "no extern transition brings joints from FREE to USED"),
    ("[[reaction]]", "does nothing"),
    ('[[reaction]]\nfire = "cutt"', "did you mean `cut`?"),
    ('[[reaction]]\nfire = "cut"\nwhen = {}', "takes one of `resource`"),
    ('[[reaction]]\nfire = "cut"\nwhen = {starts = "reach", with = "THERE"}', "only together with `ends`"),
    ('[[reaction]]\nfire = "cut"\nwhen = {ends = "reach", with = "THEER"}', "did you mean `THERE`?"),
    ('[[reaction]]\nfire = "cut"\nwhen = {resource = "power"}', "`resource` and `becomes` together"),
    ('[[reaction]]\ntrigger = {joints = "USED"}', "no extern transition brings joints to USED"),
    ('[[reaction]]\nend = {reach = "GONE"}', "There is no result `GONE` of `reach`"),
]


@pytest.mark.parametrize(("text", "sentence"), PROBLEMS, ids=range(len(PROBLEMS)))
def test_a_problem_is_one_sentence(text: str, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(ScriptError) as caught:
        load_script(write(tmp_path, text), ARM)
    assert len(caught.value.problems) == 1
    assert sentence in caught.value.problems[0]


def test_all_problems_are_reported_at_once(tmp_path: Path) -> None:
    text = '[skill.reach]\nruns = [{dely = 1}, 3, {result = "GONE"}]\n[data]\nlaod = 1\n[[reaction]]\nwhen = 3\n'
    with pytest.raises(ScriptError) as caught:
        load_script(write(tmp_path, text), ARM)
    told = " ".join(caught.value.problems)
    for piece in ("runs[0]", "runs[1]", "runs[2]", "laod", "reaction[0].when"):
        assert piece in told


@pytest.mark.parametrize("content", [b"a = ", b"\xff\xfe", b"[a]\n[a]"])
def test_what_is_no_toml_is_a_problem_like_others(content: bytes, tmp_path: Path) -> None:
    file = tmp_path / "s.toml"
    file.write_bytes(content)
    with pytest.raises(ScriptError, match="It is no"):
        load_script(file, ARM)


WORDS = ["THERE", "reach", "power", "OFF", ""]
KEYS = ["runs", "choices", "delay", "result", "output", "reached", "input", "each", "when", "ends", "to"]
scraps = st.recursive(
    st.none() | st.booleans() | st.integers(-9, 9) | st.floats() | st.sampled_from(WORDS),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(KEYS), inner, max_size=3),
    max_leaves=8,
)


@given(st.dictionaries(st.sampled_from(["seed", "skill", "data", "resources", "reaction"]), scraps))
def test_whatever_a_file_holds_ends_in_sentences(table: dict[str, object]) -> None:
    problems: list[str] = []
    script = read_script(table, problems.append)
    assert all(isinstance(problem, str) for problem in (*problems, *problems_of(script, ARM)))


@given(st.fixed_dictionaries({"reach": scraps}), st.fixed_dictionaries({"load": scraps}), st.lists(scraps, max_size=2))
def test_whatever_is_said_of_a_skill_ends_in_sentences(
    skill: dict[str, object], data: dict[str, object], reaction: list[object]
) -> None:
    problems: list[str] = []
    script = read_script({"skill": skill, "data": data, "reaction": reaction}, problems.append)
    problems += problems_of(script, ARM)
    assert len(problems) == len([each for each in problems if each.strip()])


@pytest.mark.parametrize("file", sorted(SKILLSET.parent.glob("*.mock.toml")), ids=lambda file: file.name)
def test_the_scripts_of_the_m600_fit_it(file: Path) -> None:
    assert tomllib.loads(file.read_text(encoding="utf-8"))
    load_script(file, ROBOT.load_skillset())


def test_the_script_in_the_documentation_is_valid(tmp_path: Path) -> None:
    page = (SKILLSET.parents[3] / "docs/mocks.md").read_text(encoding="utf-8")
    example = page.partition("```toml\n")[2].partition("```")[0]
    script = load_script(write(tmp_path, example), ROBOT.load_skillset())
    assert len(script.skills) == 3
    assert len(script.reactions) == 2
