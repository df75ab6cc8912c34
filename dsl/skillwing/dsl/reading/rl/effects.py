"""Names for the effects that `.rl` files write inline."""

from __future__ import annotations

from collections.abc import Sequence

from skillwing.dsl.reading.syntax import ChangeSyntax, CoinedWord, EffectSyntax
from skillwing.dsl.spans import Word

NOTHING = "nothing"


class InlineEffects:
    """The effects of one skill. Equal ones are one effect, named after its changes.

    `motion -> Used` becomes `motion_to_Used`, two changes are joined by `_and_`, an effect without any is `nothing`.
    """

    def __init__(self) -> None:
        self._by_changes: dict[tuple[tuple[str, str], ...], EffectSyntax] = {}

    @property
    def declared(self) -> tuple[EffectSyntax, ...]:
        """The effects in the order of their first use."""
        return tuple(self._by_changes.values())

    def of(self, changes: Sequence[ChangeSyntax]) -> Word | None:
        """The name of the effect with these changes; None where there are none."""
        if not changes:
            return None
        span = changes[0].resource.span.to(changes[-1].target.span)
        name = "_and_".join(f"{change.resource.text}_to_{change.target.text}" for change in changes)
        return self._named(CoinedWord(name, span), tuple(changes))

    def nothing(self, place: Word) -> Word:
        """The name of the effect that changes nothing."""
        return self._named(CoinedWord(NOTHING, place.span), ())

    def written(self, name: str) -> str:
        """The source text of the effect of that name, without the word `effect`."""
        effect = next(effect for effect in self.declared if effect.name.text == name)
        changes = [f"{change.resource.text} -> {change.target.text}" for change in effect.changes]
        return changes[0] if len(changes) == 1 else f"{{ {'  '.join(changes)} }}"

    def _named(self, wanted: CoinedWord, changes: tuple[ChangeSyntax, ...]) -> Word:
        key = tuple((change.resource.text, change.target.text) for change in changes)
        if key not in self._by_changes:
            taken = {effect.name.text for effect in self._by_changes.values()}
            name = wanted.text
            while name in taken:  # `a_to_B -> C` and `a -> B_to_C`
                name += "_"
            self._by_changes[key] = EffectSyntax(CoinedWord(name, wanted.span), changes)
        return CoinedWord(self._by_changes[key].name.text, wanted.span)
