"""Pages made from Markdown templates, which hold the prose, and from tables and figures, which the code holds."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from string import Template

from skillwing.services.protocol import ErrorCode
from skillwing.services.wire.channel import Channel, Kind

_KEY = re.compile(
    r"^- \*\*`(?P<key>[^`]+)`\*\* \((?P<kind>[^)]+)\): (?P<text>.*?)(?P<without> \*Without it:\* .*)?$", re.MULTILINE
)
WITHOUT = " *Without it:* "


@dataclass(frozen=True, slots=True)
class Meaning:
    """Prose about a key. without: effect of its absence on the robot, empty where nobody has to offer it."""

    text: str
    without: str = ""


class PageTemplate:
    """A template: Markdown with `$NAME` for figures and tables, and an item ``**`KEY`** (KIND): TEXT`` for each key."""

    def __init__(self, package: str, name: str, figures: Mapping[str, object]) -> None:
        values = {each: f"{value:g}" if isinstance(value, float) else value for each, value in figures.items()}
        text = files(package).joinpath(name).read_text(encoding="utf-8")
        self._text = Template(text).safe_substitute(values)
        self.meanings: dict[tuple[str, str], Meaning] = {
            (line["key"], line["kind"]): Meaning(line["text"], (line["without"] or "").removeprefix(WITHOUT))
            for line in _KEY.finditer(self._text)
        }

    def meaning(self, channel: Channel) -> Meaning:
        """The prose about a key."""
        return self.meanings[channel.pattern, channel.kind]

    def page(
        self, channels: Iterable[Channel], tables: Mapping[str, Iterable[str]], code: Callable[[ErrorCode], str]
    ) -> str:
        """The page. code: Markdown of a refusal's code. Raises KeyError if a table or the prose of a key is missing."""
        rows = {(channel.pattern, str(channel.kind)): channel for channel in channels}
        if missing := rows.keys() - self.meanings.keys():
            raise KeyError(f"the template does not explain {missing}")

        def with_facts(line: re.Match[str]) -> str:
            facts = "".join(_facts(rows[line["key"], line["kind"]], code))
            return f"- **`{line['key']}`** ({line['kind']}): {line['text']}{facts}{line['without'] or ''}"

        values = {name: "\n".join(lines).rstrip("\n") for name, lines in tables.items()}
        return Template(_KEY.sub(with_facts, self._text)).substitute(values)


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """A table of Markdown."""
    yield f"| {' | '.join(heads)} |"
    yield "|---" * len(heads) + "|"
    yield from (f"| {' | '.join(cells)} |" for cells in rows)


def _facts(channel: Channel, code: Callable[[ErrorCode], str]) -> Iterator[str]:
    if channel.array:
        yield f" {'Reply' if channel.kind is Kind.QUERY else 'Payload'}: {channel.array}."
    if channel.refusals:
        yield f" Refused with {', '.join(map(code, channel.refusals))}."
