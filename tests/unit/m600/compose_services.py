"""The services of docker-compose.yml that follow from the skillset. `make generate` runs this file.

A comment `make generate, for each skill: ...` holds a line with `@` for the name of a skill. The lines of all skills
stand below it, up to a comment `end`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from skillwing.m600.robot import ROBOT

COMPOSE_FILE = Path(__file__).parents[3] / "docker-compose.yml"
_BLOCK = re.compile(r"^( *)# make generate, for each skill: (.*)\n(?:.*\n)*?\1# end$", re.MULTILINE)


def renewed(text: str, skills: Iterable[str]) -> str:
    """The text of the Compose file with the lines of these skills."""
    names = list(skills)

    def block(match: re.Match[str]) -> str:
        indent, template = match.groups()
        lines = [match[0].partition("\n")[0], *(indent + template.replace("@", name) for name in names)]
        return "\n".join([*lines, f"{indent}# end"])

    return _BLOCK.sub(block, text)


def main() -> None:
    skills = [skill.name for skill in ROBOT.load_skillset().skills]
    COMPOSE_FILE.write_text(renewed(COMPOSE_FILE.read_text("utf-8"), skills), encoding="utf-8")


if __name__ == "__main__":
    main()
