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
    """A template: Markdown with `$NAME` for figures and tables, and an item ``**`KEY`** (KIND): TEXT`` for each key.

    Without an item, the docstring of a key's message explains the key. code: Markdown of a refusal's code.
    """

    def __init__(
        self, package: str, name: str, figures: Mapping[str, object], code: Callable[[ErrorCode], str]
    ) -> None:
        values = {each: f"{value:g}" if isinstance(value, float) else value for each, value in figures.items()}
        text = files(package).joinpath(name).read_text(encoding="utf-8")
        self._text = Template(text).safe_substitute(values)
        self._code = code
        self._meanings: dict[tuple[str, str], Meaning] = {
            (item["key"], item["kind"]): Meaning(item["text"], (item["without"] or "").removeprefix(WITHOUT))
            for item in _KEY.finditer(self._text)
        }

    def meaning(self, channel: Channel) -> Meaning:
        """The prose about a key."""
        summary = (channel.message.__doc__ or "").partition("\n\n")[0]
        return self._meanings.get((channel.pattern, channel.kind)) or Meaning(" ".join(summary.split()))

    def table(
        self, heads: Sequence[str], channels: Iterable[Channel], cells: Callable[[Channel], Sequence[str]]
    ) -> Iterator[str]:
        """A table of keys, with an item for each key that has none in the template."""
        yield f"| {' | '.join(heads)} |"
        yield "|---" * len(heads) + "|"
        unexplained: list[Channel] = []
        for channel in channels:
            yield f"| {' | '.join(cells(channel))} |"
            if (channel.pattern, channel.kind) not in self._meanings:
                unexplained.append(channel)
        yield from ["", *map(self._item, unexplained)] if unexplained else ()

    def page(self, channels: Iterable[Channel], tables: Mapping[str, Iterable[str]]) -> str:
        """The page. Raises KeyError if a table is missing, or a key that the template explains."""
        rows = {(channel.pattern, str(channel.kind)): channel for channel in channels}
        values = {name: "\n".join(lines).rstrip("\n") for name, lines in tables.items()}
        text = _KEY.sub(lambda item: self._item(rows[item["key"], item["kind"]]), self._text)
        return Template(text).substitute(values)

    def _item(self, channel: Channel) -> str:
        meaning = self.meaning(channel)
        text = f"- **`{channel.pattern}`** ({channel.kind}): {meaning.text}"
        if channel.array:
            text += f" {'Reply' if channel.kind is Kind.QUERY else 'Payload'}: {channel.array}."
        if channel.refusals:
            text += f" Refused with {', '.join(map(self._code, channel.refusals))}."
        return text + (WITHOUT + meaning.without if meaning.without else "")
