"""Option `--robot` in the commands that messages advise. Without it, such a command fails among several robots."""

from __future__ import annotations

import re
from collections.abc import Sequence

ROBOT_COMMANDS = frozenset(
    {
        *("data", "doctor", "down", "fault", "interrupt", "modify", "pilot", "ready", "resources", "script"),
        *("start", "status", "top", "trigger"),
        *("mission abort", "mission list", "mission pause", "mission resume", "mission run", "mission watch"),
    }
)
"""Commands that choose a running robot by `--robot`."""
_ADVISED = re.compile(r"`skillwing ((?:mission )?[a-z-]+)([^`\n]*)`")
_CHOSEN = re.compile(r" (?:--robot|-r)\b")


def with_robot(text: str, robot: str | None) -> str:
    """A text whose commands in backticks choose this robot, where they can and do not yet. None changes nothing."""
    if robot is None:
        return text

    def chosen(found: re.Match[str]) -> str:
        command, rest = found.groups()
        if command not in ROBOT_COMMANDS or _CHOSEN.search(rest):
            return found.group()
        return f"`skillwing {command}{rest} --robot {robot}`"

    return _ADVISED.sub(chosen, text)


def named_robot(words: Sequence[str]) -> str | None:
    """The running robot that the words of a command line choose, None for none. words: without the program's name."""
    own = list(words[: words.index("--")] if "--" in words else words)
    if not ROBOT_COMMANDS & {" ".join(own[:1]), " ".join(own[:2])}:
        return None
    for place, word in enumerate(own):
        option, given, value = word.partition("=")
        if option in ("--robot", "-r"):
            name = value if given else "".join(own[place + 1 : place + 2])
            if name and "=" not in name:
                return name
    return None
