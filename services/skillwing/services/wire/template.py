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
    r"(?:^\n)?^- \*\*`(?P<key>[^`]+)`\*\* \((?P<kind>[^)]+)\): (?P<text>.*?)(?P<without> \*Without it:\* .*)?\n",
    re.MULTILINE,
)
_CONTINUED = re.compile(_KEY.pattern + r"[ \t]+(?P<line>\S.*)", re.MULTILINE)
_SENTENCES = re.compile(r"(?<=\.) ")
WITHOUT = " *Without it:* "
UNUSED = "No effect on the robot."
"""Effect of the absence of a key that no process uses."""


@dataclass(frozen=True, slots=True)
class Meaning:
    """Prose about a key. without: effect of its absence on the robot, empty where nobody has to offer it."""

    text: str
    without: str = ""


class PageTemplate:
    """A template: Markdown with `$NAME` for figures and tables, and an item ``**`KEY`** (KIND): TEXT`` for each key.

    Without an item, the first sentence of its message explains a key. code: Markdown of a refusal's code. Raises
    ValueError if an item goes on in a second line.
    """

    def __init__(
        self, package: str, name: str, figures: Mapping[str, object], code: Callable[[ErrorCode], str]
    ) -> None:
        values = {each: f"{value:g}" if isinstance(value, float) else value for each, value in figures.items()}
        text = files(package).joinpath(name).read_text(encoding="utf-8")
        self._text = Template(text).safe_substitute(values)
        if continued := _CONTINUED.search(self._text):
            told = f"The item `{continued['key']}` of {name} has a second line: {continued['line']!r}."
            raise ValueError(f"{told} Write each item in one line.")
        self._code = code
        self._meanings: dict[tuple[str, str], Meaning] = {
            (item["key"], item["kind"]): Meaning(item["text"], (item["without"] or "").removeprefix(WITHOUT))
            for item in _KEY.finditer(self._text)
        }

    def meaning(self, channel: Channel) -> Meaning:
        """The prose about a key."""
        summary = " ".join((channel.message.__doc__ or "").split())
        derived = Meaning(_SENTENCES.split(summary)[0], "" if channel.used_by else UNUSED)
        return self._meanings.get((channel.pattern, channel.kind), derived)

    def table(
        self, heads: Sequence[str], channels: Iterable[Channel], cells: Callable[[Channel], Sequence[str]]
    ) -> Iterator[str]:
        """A table of keys, and below it an item for each."""
        yield f"| {' | '.join(heads)} |"
        yield "|---" * len(heads) + "|"
        items = [""]
        for channel in channels:
            yield f"| {' | '.join(cells(channel))} |"
            items.append(self._item(channel))
        yield from items

    def page(self, channels: Iterable[Channel], tables: Mapping[str, Iterable[str]]) -> str:
        """The page, whose items follow the tables. Raises KeyError if a table is missing, or a key that has an item."""
        if unknown := self._meanings.keys() - {(channel.pattern, str(channel.kind)) for channel in channels}:
            raise KeyError(*unknown)
        values = {name: "\n".join(lines).rstrip("\n") for name, lines in tables.items()}
        return Template(_KEY.sub("", self._text)).substitute(values)

    def _item(self, channel: Channel) -> str:
        meaning = self.meaning(channel)
        text = f"- **`{channel.pattern}`** ({channel.kind}): {meaning.text}"
        if channel.array:
            text += f" {'Reply' if channel.kind is Kind.QUERY else 'Payload'}: {channel.array}."
        if channel.refusals:
            text += f" Refused with {', '.join(map(self._code, channel.refusals))}."
        return text + (WITHOUT + meaning.without if meaning.without else "")
