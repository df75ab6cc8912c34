"""The table of all problems that the language reports: code, severity and title.

The page `docs/errors/CODE.md` explains a code with an example and a solution. A code never changes its meaning and is
never reused. New codes come at the end of their group.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal as OneOf
from typing import TypeAlias

Severity: TypeAlias = OneOf["error", "warning"]


@dataclass(frozen=True, slots=True)
class Code:
    """One kind of problem."""

    name: str
    severity: Severity
    title: str


_TABLE = (
    # --- syntax
    Code("SW001", "error", "missing closing bracket"),
    Code("SW002", "error", "unexpected word"),
    Code("SW003", "error", "misspelt word of the language"),
    Code("SW004", "error", "unreadable character"),
    Code("SW005", "error", "missing or wrong punctuation"),
    Code("SW006", "error", "not a skillset"),
    # --- names
    Code("SW010", "error", "unknown resource"),
    Code("SW011", "error", "unknown state"),
    Code("SW012", "error", "unknown effect"),
    Code("SW013", "error", "unknown type"),
    Code("SW014", "error", "unknown datum or input"),
    Code("SW015", "error", "unknown field or value"),
    Code("SW016", "error", "declared twice"),
    Code("SW017", "error", "section given twice"),
    Code("SW018", "error", "name not usable"),
    Code("SW019", "error", "names collide in generated code"),
    # --- types, units, ranges
    Code("SW020", "error", "comparison of different things"),
    Code("SW021", "error", "malformed unit"),
    Code("SW022", "error", "impossible range"),
    Code("SW023", "error", "default does not fit"),
    Code("SW024", "error", "type contains itself"),
    Code("SW025", "error", "not a duration"),
    Code("SW026", "error", "impossible array"),
    Code("SW027", "error", "wrong kind of predicate"),
    Code("SW028", "error", "not a predicate"),
    Code("SW029", "error", "nested too deeply"),
    # --- resources
    Code("SW030", "error", "no single initial state"),
    Code("SW031", "error", "unreachable state"),
    # --- effects and events
    Code("SW040", "error", "effect drives an extern transition"),
    Code("SW041", "error", "no such transition"),
    Code("SW042", "error", "effect can never apply"),
    Code("SW043", "error", "resource changed twice"),
    Code("SW044", "error", "event drives an internal transition"),
    # --- logic
    Code("SW050", "error", "precondition never holds"),
    Code("SW051", "error", "invariant never holds"),
    Code("SW052", "error", "postcondition never holds"),
    Code("SW053", "error", "invariant false from the start"),
    Code("SW054", "error", "preconditions contradict each other"),
    Code("SW055", "error", "guard never holds"),
    Code("SW056", "error", "condition on a modifiable input"),
    # --- results and ends
    Code("SW060", "error", "no interrupt effect"),
    Code("SW061", "error", "result that cannot be observed"),
    Code("SW062", "error", "half-marked results"),
    # --- units
    Code("SW070", "error", "unknown unit"),
    Code("SW071", "error", "comparison of different dimensions"),
    Code("SW072", "error", "comparison of different scales"),
    # --- warnings
    Code("SW080", "warning", "resource leak"),
    Code("SW081", "warning", "unused effect"),
    Code("SW082", "warning", "unused resource"),
    Code("SW083", "warning", "unused type"),
    Code("SW084", "warning", "start effect may not apply"),
    Code("SW085", "warning", "invariant may be false from the start"),
    Code("SW086", "warning", "state that nothing brings about"),
    Code("SW087", "warning", "results that cannot be distinguished"),
    Code("SW088", "warning", "too many combinations to check"),
    # --- files in ONERA's robot language; SW092 and SW095 are retired
    Code("SW090", "warning", "type without contents"),
    Code("SW091", "warning", "parameter read as something else"),
    Code("SW093", "warning", "postcondition of an interruption"),
    Code("SW094", "warning", "interruption that changes nothing"),
    Code("SW096", "warning", "name of a postcondition"),
    Code("SW097", "warning", "postcondition on what the effect changes"),
    Code("SW098", "error", "included file cannot be read"),
    Code("SW099", "error", "files include each other"),
    Code("SW100", "warning", "skillset of an included file"),
)

CODES = {code.name: code for code in _TABLE}

# An installed package has a copy of the pages.
_INSTALLED = Path(__file__).parent / "pages"
_REPOSITORY = Path(__file__).parents[4] / "docs" / "errors"


def page_on(code: str) -> str:
    """The Markdown text of the page on a code. Raises FileNotFoundError if there is none."""
    folder = _INSTALLED if _INSTALLED.is_dir() else _REPOSITORY
    return (folder / f"{code}.md").read_text(encoding="utf-8")
