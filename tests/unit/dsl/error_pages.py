"""The pages on error codes, `docs/errors/CODE.md`: one each, with an example that fails and one that is fixed.

`make errors` runs this file. It writes the heading and the output under the first example into each page, and the
index of all pages.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from skillwing.dsl.checking.checker import check
from skillwing.dsl.diagnostics.codes import CODES
from skillwing.dsl.diagnostics.diagnostic import Diagnostic, render_all

FOLDER = Path(__file__).parents[3] / "docs" / "errors"
EXAMPLES = Path(__file__).parents[3] / "examples" / "onera"
_EXAMPLE = re.compile(r"^```(skillset|rl)\n(.*?)^```\n", re.MULTILINE | re.DOTALL)
_OUTPUT = re.compile(r"^```text\n.*?^```\n", re.MULTILINE | re.DOTALL)

_INDEX = """\
# The errors and warnings of the skillset language

Each page explains a code with an example, the output of `skillwing check`, and a fix. `skillwing check --explain
{example}` shows the page on a terminal. A file with warnings can be used, unless `check --strict` is given. The limits
of the checker are in [the language](../language.md#analysis).

| code | | problem |
|---|---|---|
{rows}
"""


@dataclass(frozen=True)
class Page:
    """A page: its code and its text."""

    code: str
    text: str

    def diagnostics(self, example: int) -> tuple[Diagnostic, ...]:
        """The diagnostics of the first example or the second."""
        source, file = self._example(example)
        return check(source, file, included_example).diagnostics

    def renewed(self) -> str:
        """The text with its present heading and output."""
        source, _ = self._example(0)
        output = render_all(self.diagnostics(0), source)
        heading = f"# {self.code}: {CODES[self.code].title}"
        text = re.sub(r"\A.*\n", lambda _: f"{heading}\n", self.text)
        return _OUTPUT.sub(lambda _: f"```text\n{output}\n```\n", text, count=1)

    def _example(self, number: int) -> tuple[str, str]:
        kind, source = _EXAMPLE.findall(self.text)[number]
        return source, f"example.{kind}"


def included_example(path: Path) -> str:
    """The text of a file that an example includes, out of `examples/onera/`."""
    return (EXAMPLES / path.name).read_text(encoding="utf-8")


def pages() -> list[Page]:
    return [Page(path.stem, path.read_text(encoding="utf-8")) for path in sorted(FOLDER.glob("SW*.md"))]


def index() -> str:
    """The text of `docs/errors/README.md`."""
    rows = [f"| [{code.name}]({code.name}.md) | {code.severity} | {code.title} |" for code in CODES.values()]
    return _INDEX.format(example=next(iter(CODES)), rows="\n".join(rows))


def main() -> None:
    for page in pages():
        (FOLDER / f"{page.code}.md").write_text(page.renewed(), encoding="utf-8")
    (FOLDER / "README.md").write_text(index(), encoding="utf-8")


if __name__ == "__main__":
    main()
