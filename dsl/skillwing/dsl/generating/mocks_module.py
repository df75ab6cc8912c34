"""`mocks.py`: typed scripts for mocked skills."""

from __future__ import annotations

from collections.abc import Iterator

from skillwing.dsl.generating.source_text import INDENT, LINE_LENGTH, TypeNames, answer_classes, bracketed, exemptions
from skillwing.dsl.model import Result, Skill, Skillset
from skillwing.dsl.naming import class_name


def lines(skillset: Skillset) -> Iterator[str]:
    names = TypeNames()
    body = [line for skill in skillset.skills for line in _mock(skill, names)]
    yield from exemptions(skillset)
    yield f'"""Typed mock scripts for skills of `{skillset.name}`, for tests and for missions without a robot.'
    yield ""
    yield _example(skillset)
    yield '"""'
    yield ""
    yield "from __future__ import annotations"
    yield ""
    ending = any(skill.results for skill in skillset.skills)
    runs = ["MockRun"] * ending + ["MockScript"]
    typed = ["Delay"] * ending + ["Runs", "SkillMock"] * bool(skillset.skills) + ["StopDelay"] * ending + ["scripted"]
    yield from (f"from skillwing.services.mocking import {name} as _{name}" for name in runs)
    yield from (f"from skillwing.services.mocking.typed import {name} as _{name}" for name in typed)
    if imports := list(names.imports()):
        yield from ("", *imports)
    yield from body
    yield from _script(skillset)


def _example(skillset: Skillset) -> str:
    for skill in skillset.skills:
        for result in skill.results:
            return f"script({skill.name}=[{class_name(skill.name)}Mock.ended_{result.name}(delay=0.5)])"
    return "script()"


def _mock(skill: Skill, names: TypeNames) -> Iterator[str]:
    outputs, feedback = answer_classes(skill, names)
    yield from ("", "", f"class {class_name(skill.name)}Mock(_SkillMock[{outputs}, {feedback}]):")
    yield f'{INDENT}"""Run of one goal of a mocked `{skill.name}`."""'
    for result in skill.results:
        yield ""
        yield from _ending(result, outputs, feedback)


def _ending(result: Result, outputs: str, feedback: str) -> Iterator[str]:
    parameters = ["cls"]
    passed = [f'"{result.name}"']
    if outputs != "None":
        parameters.append(f"output: {outputs} | None = None")
        passed.append("output=output")
    parameters.append("*")
    if feedback != "None":
        parameters.append(f"feedback: {feedback} | None = None")
        passed.append("feedback=feedback")
    parameters += ["delay: _Delay = 1.0", "stop_delay: _StopDelay = 0.0"]
    passed += ["delay=delay", "stop_delay=stop_delay"]
    yield f"{INDENT}@classmethod"
    yield from (INDENT + line for line in bracketed(f"def ended_{result.name}(", parameters, ") -> _MockRun:"))
    ending = "success" if result.success else "failure"
    yield f'{INDENT * 2}"""End as a {ending}, `delay` seconds after the dispatch."""'
    yield f"{INDENT * 2}return cls.ended({', '.join(passed)})"


def _script(skillset: Skillset) -> Iterator[str]:
    skills = [skill.name for skill in skillset.skills]
    seed = "" if "seed" in skills else "seed"
    yield from ("", "")
    parameters = [f"{name}: _Runs = ()" for name in skills] + (["seed: int = 0"] if seed else [])
    yield from bracketed("def script(", ["*", *parameters], ") -> _MockScript:")
    yield f'{INDENT}"""A script with the runs of goals by skill, in sequence; the last run repeats.'
    yield ""
    yield f"{INDENT}`Choices` of runs are drawn with the seed. A skill without runs ends as without a script."
    yield f'{INDENT}"""'
    pairs = [f'"{name}": {name}' for name in skills]
    passed = ["seed"] if seed else []
    runs = "{" + ", ".join(pairs) + "}"
    one_line = f"{INDENT}return _scripted({', '.join([runs, *passed])})"
    if len(one_line) <= LINE_LENGTH:
        yield one_line
        return
    yield f"{INDENT}return _scripted("
    yield from (INDENT * 2 + line for line in bracketed("{", pairs, "},"))
    yield from (f"{INDENT * 2}{argument}," for argument in passed)
    yield f"{INDENT})"
