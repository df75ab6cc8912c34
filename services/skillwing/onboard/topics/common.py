"""Types and messages that several subjects share."""

from __future__ import annotations

from typing import Annotated, TypeAlias

import msgspec

from skillwing.services.protocol import LONGEST_SENTENCE, Message

LARGEST_COMPONENT = 1e6
Component: TypeAlias = Annotated[float, msgspec.Meta(ge=-LARGEST_COMPONENT, le=LARGEST_COMPONENT)]
"""A component of a position, velocity, ... in SI units. The bound refuses values that no drone can reach."""
Sentence: TypeAlias = Annotated[str, msgspec.Meta(max_length=LONGEST_SENTENCE)]
"""Text for people. Its length is bounded, because receivers quote it in longer messages."""
Vector2 = tuple[Component, Component]
Vector3 = tuple[Component, Component, Component]
Quaternion = tuple[Component, Component, Component, Component]


class Empty(Message, frozen=True, kw_only=True):
    pass


class Done(Message, frozen=True, kw_only=True):
    """A node accepted a command. Refusals are typed error replies."""

    text: str = ""
