"""`processes.py`: the path of the skillset, and the manager class of each skill."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from skillwing.dsl.generating.source_text import INDENT, quoted
from skillwing.dsl.model import Skillset
from skillwing.dsl.naming import manager_class


def lines(skillset: Skillset, location: Sequence[str], managed: Collection[str]) -> Iterator[str]:
    """The lines of the module.

    location: path of the skillset's file in the package. managed: the skills that have a file in `skills/`.
    """
    yield f'"""The managers of `{skillset.name}`: their skillset, and the manager class of each skill.'
    yield ""
    yield "`robot.py` puts them into the robot's table. It lists the skills with a file in `skills/`."
    yield '"""'
    yield ""
    yield "from __future__ import annotations"
    yield ""
    yield "from pathlib import Path"
    yield ""
    yield 'PACKAGE = __name__.removesuffix(".generated.processes")'
    yield 'TABLE = f"{PACKAGE}.robot:ROBOT"'
    yield f"SKILLSET = Path(__file__).parents[1] / {quoted('/'.join(location))}"
    entries = [
        f'"{skill.name}": f"{{PACKAGE}}.skills.{skill.name}:{manager_class(skill.name)}",'
        for skill in skillset.skills
        if skill.name in managed
    ]
    if entries:
        yield from ("HOOKS = {", *(INDENT + entry for entry in entries), "}")
    else:
        yield "HOOKS: dict[str, str] = {}"
