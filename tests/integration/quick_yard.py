"""The yard of `examples/yard` and its two drones on mocks that fly each leg in a fraction of a second."""

from __future__ import annotations

from pathlib import Path

from command_line import Command
from running_system import until

from skillwing.services.terminal.exit_codes import OK

YARD = Path(__file__).parents[2] / "examples" / "yard"
ROBOTS = ("left", "right", "yard")
PATIENCE = 60.0
QUICK = """
[skill.takeoff]
delay = 0.8
[skill.land]
delay = 0.3
[skill.goto_straight]
delay = 0.3

[[reaction]]
when = {ends = "goto_straight", with = "ARRIVED"}
set = {position = {input = "target"}}
"""
"""Added to the script of a drone. Its position jumps to the target at the end of a leg: the yard sees it there."""


def up_words(robot: str, folder: Path) -> tuple[str, ...]:
    """Arguments of `skillwing up` for a drone on quick mocks, or for the yard. folder: for the script of the drone."""
    if robot == "yard":
        return ("--robot", str(YARD))
    script = folder / f"{robot}.mock.toml"
    script.write_text((YARD / script.name).read_text(encoding="utf-8") + QUICK, encoding="utf-8")
    return ("--mock", "--robot-name", robot, "--script", str(script))


def wait_until_free(skillwing: Command) -> None:
    """Wait until each place is free: the watch reads the positions of both drones, and the yard believes it."""

    def free() -> bool:
        said = skillwing("resources", "--robot", "yard", "--json")
        # On a busy machine a process may be silent for longer than the command waits for it.
        return said.code == OK and set(said.json["states"].values()) == {"FREE"}

    until(free, "each place to be free")
