"""The table of roles in docs/keys.md, written from the policy: `make generate`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from skillwing.services.access.policy import Grants, RobotAccess, person_grants, process_grants
from skillwing.services.terminal.doc_sections import Marks
from skillwing.services.wire.channel import PEOPLE, PROCESSES, Role

PAGE = Path(__file__).parents[3] / "docs" / "keys.md"
MARKS = Marks.named("roles")
SKILLSET, NAME = "SKILLSET", "NAME"
PROCESS_NAMES = {role: "skill/SKILL" if role is Role.SKILL_MANAGER else "PROCESS" for role in PROCESSES}
EVERYWHERE = {
    f"{SKILLSET}/resource/state",
    f"{SKILLSET}/resource/ready",
    f"{SKILLSET}/resource/robot",
    f"{SKILLSET}/skill/*/goal",
    f"{SKILLSET}/data/*",
}
"""Questions that every role may ask."""


def role_table() -> str:
    """A row for each role, with keys relative to the skillset."""
    rows = [
        "| role | may ask, in addition to reading | may publish, and answer | may hold tokens |",
        "|---|---|---|---|",
    ]
    for role in (*PEOPLE, *PROCESSES):
        grants = _grants(role)
        offers = grants.streams | grants.events | grants.serves
        cells = [_keys(grants.asks - EVERYWHERE), _keys(offers), _keys(grants.tokens)]
        rows.append(f"| {role} | {' | '.join(cells)} |")
    return "\n".join(rows)


def _grants(role: Role) -> Grants:
    if role in PEOPLE:
        return person_grants(RobotAccess("ROBOT", SKILLSET, {}), role, NAME)
    process = PROCESS_NAMES[role]
    return process_grants(RobotAccess("ROBOT", SKILLSET, {process: role}), process)


def _keys(keys: Iterable[str]) -> str:
    shown = sorted(key.removeprefix(f"{SKILLSET}/") for key in keys)
    return ", ".join(f"`{key}`" for key in shown)


if __name__ == "__main__":
    MARKS.replace(PAGE, role_table())
