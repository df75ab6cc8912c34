"""Checks of all messages of a core: each is as its message class has it, and of this moment."""

from __future__ import annotations

from typing import Any

from skillwing.services.protocol import Lost, Message, Record, ResourceStates, Violated, decode, encode


def assert_sound(message: Message, now: float) -> None:
    """The message arrives as it was sent, and tells the time at which it was said."""
    assert decode(encode(message), type(message)) == message
    if isinstance(message, Record | ResourceStates | Violated | Lost):
        assert message.t == now, message


def assert_all_sound(messages: Any, now: float) -> None:
    for message in messages:
        if isinstance(message, Message):
            assert_sound(message, now)
