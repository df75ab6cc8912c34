"""Bad payloads, and some valid ones, for every key.

A payload begins as a valid message, made from the types of its fields, and is then corrupted in one of many ways. A
`random.Random` makes all choices, so that they come from hypothesis or from a seed.
"""

from __future__ import annotations

import json
import math
import pickle
import struct
from collections.abc import Callable, Sequence
from random import Random
from typing import Any, TypeAlias

import msgspec

from skillwing.services.protocol import MAX_MESSAGE_BYTES, MAX_NESTING

Value: TypeAlias = Any
Spoiler: TypeAlias = Callable[[Random, dict[str, Value]], object]

TEXTS = (
    "",
    "x",
    "takeoff",
    "ARRIVED",
    "axes_authority",
    "battery",
    "é\u0000\u202e",
    "\U0001f681" * 9,
    "../../etc",
    "*/**",
)
NUMBERS = (0, 1, -1, 2**31, 2**63 - 1, -(2**63))
FLOATS = (0.0, 1.0, -1.0, 0.1, 1e308, -1e308, 5e-324)
NOT_FINITE = (math.nan, math.inf, -math.inf)
FOREIGN = (b"", b"\xc1", b"null", b"{}", b"\x00", b"\xff" * 64, b"GET / HTTP/1.1\r\n\r\n")
MANY = 10_000
"""Number of small elements that make a message as large as permitted."""
LONG_INTEGER = struct.pack(">BQ", 0xCF, 2**64 - 1)


# --- valid messages --------------------------------------------------------------------------------------------------


def valid(random: Random, kind: Any, words: Sequence[str] = TEXTS) -> dict[str, Value]:
    """Fields of a message of the kind: right types, senseless values. words: texts that may mean something."""
    return _value(random, msgspec.inspect.type_info(kind), words)


def _value(random: Random, kind: msgspec.inspect.Type, words: Sequence[str]) -> Value:  # noqa: PLR0911, PLR0912 - a case for each type
    match kind:
        case msgspec.inspect.StructType():
            return _struct(random, kind, words)
        case msgspec.inspect.UnionType():
            return _value(random, random.choice(kind.types), words)
        case msgspec.inspect.Metadata():
            return _value(random, kind.type, words)
        case msgspec.inspect.IntType():
            return random.choice(NUMBERS)
        case msgspec.inspect.FloatType():
            return random.choice([random.choice(FLOATS), random.uniform(-100.0, 100.0)])
        case msgspec.inspect.BoolType():
            return random.random() < 0.5
        case msgspec.inspect.StrType():
            return random.choice(words)
        case msgspec.inspect.EnumType():
            return random.choice([member.value for member in kind.cls])
        case msgspec.inspect.LiteralType():
            return random.choice(kind.values)
        case msgspec.inspect.TupleType():
            return [_value(random, item, words) for item in kind.item_types]
        case msgspec.inspect.VarTupleType() | msgspec.inspect.ListType():
            return [_value(random, kind.item_type, words) for _ in range(random.randrange(3))]
        case msgspec.inspect.DictType():
            return {random.choice(words): _value(random, kind.value_type, words) for _ in range(random.randrange(3))}
        case msgspec.inspect.NoneType():
            return None
        case msgspec.inspect.AnyType():
            return random.choice([None, True, 7, 1.5, "x", [1.0], {"x": 1.0, "y": 2.0, "z": 3.0}])
        case _:
            raise AssertionError(f"messages have a type that payloads are not made of yet: {kind}")


def _struct(random: Random, kind: msgspec.inspect.StructType, words: Sequence[str]) -> dict[str, Value]:
    fields: dict[str, Value] = {} if kind.tag_field is None else {kind.tag_field: kind.tag}
    for field in kind.fields:
        if field.encode_name == "v":
            fields["v"] = field.default
        elif field.required or random.random() < 0.5:
            fields[field.encode_name] = _value(random, field.type, words)
    return fields


# --- spoilt ones -----------------------------------------------------------------------------------------------------


def _other(random: Random) -> Value:
    """A value of some type, most likely the wrong one."""
    return random.choice(
        [None, True, -1, 2**64 - 1, *FLOATS, *NOT_FINITE, "", "x" * 5000, b"\x00\xff", [], [[]], {}, {"": None}]
    )


def _replaced(random: Random, fields: dict[str, Value]) -> object:
    return {**fields, random.choice([*fields, "v"]): _other(random)}


def _replaced_deep_inside(random: Random, fields: dict[str, Value]) -> object:
    name = random.choice(list(fields))
    inner = fields[name]
    if isinstance(inner, dict):
        return {**fields, name: _replaced_deep_inside(random, inner) if inner else {"x": _other(random)}}
    if isinstance(inner, list) and inner:
        return {**fields, name: [_other(random), *inner[1:]]}
    return {**fields, name: _other(random)}


def _missing(random: Random, fields: dict[str, Value]) -> object:
    gone = random.choice(list(fields))
    return {name: value for name, value in fields.items() if name != gone}


def _unknown(random: Random, fields: dict[str, Value]) -> object:
    return {**fields, random.choice(["extra", "", "__class__", "type"]): _other(random)}


def _version(random: Random, fields: dict[str, Value]) -> object:
    return {**fields, "v": random.choice([0, 2, -1, 2**40, "1", None, 1.0])}


def _not_finite(random: Random, fields: dict[str, Value]) -> object:
    numbers = [name for name, value in fields.items() if isinstance(value, float)] or ["t"]
    return {**fields, random.choice(numbers): random.choice(NOT_FINITE)}


def _nested(random: Random, fields: dict[str, Value]) -> object:
    depth = random.choice([MAX_NESTING - 2, MAX_NESTING + 2, 400])
    value: Value = 1.0
    for level in range(depth):
        value = [value] if level % 2 else {"x": value}
    return {**fields, random.choice(list(fields)): value}


def _long(random: Random, fields: dict[str, Value]) -> object:
    return {**fields, random.choice(list(fields)): "a" * random.choice([101, 201, 20_000])}


def wide(random: Random, fields: dict[str, Value]) -> object:
    """A map with too many names, each of which may produce a sentence."""
    maps = [name for name, value in fields.items() if isinstance(value, dict)] or list(fields)
    names = [f"name{number}" for number in range(random.choice([2, 100, MANY]))]
    # All names have one value: a single value that is not finite would keep the others from being checked.
    return {**fields, random.choice(maps): dict.fromkeys(names, random.choice([0, "x", None, _other(random)]))}


def long_list(random: Random, fields: dict[str, Value]) -> object:
    """A long list of equal values in the place of a list or of any value. Converted whole numbers become larger."""
    lists = [name for name, value in fields.items() if isinstance(value, list)]
    maps = [name for name, value in fields.items() if isinstance(value, dict)]
    name = random.choice(lists or maps or list(fields))
    many = [random.choice([0, 1.0, "", [], None])] * random.choice([2, 100, 10 * MANY])
    inner = fields[name]
    return {**fields, name: dict.fromkeys(inner or ("x",), many) if isinstance(inner, dict) else many}


def _bare(random: Random, fields: dict[str, Value]) -> object:
    return random.choice([list(fields.values()), list(fields), None, 1, "x", [fields], {}])


SPOILERS: tuple[Spoiler, ...] = (
    _replaced,
    _replaced_deep_inside,
    _missing,
    _unknown,
    _version,
    _not_finite,
    _nested,
    _long,
    wide,
    long_list,
    _bare,
)


def payload(random: Random, kind: Any, words: Sequence[str] = TEXTS) -> bytes:
    """Payload for a key that expects messages of the kind. A fifth of the payloads are valid messages."""
    message = valid(random, kind, words)
    match random.randrange(5):
        case 0:
            return msgspec.msgpack.encode(message)
        case 1 | 2:
            return msgspec.msgpack.encode(random.choice(SPOILERS)(random, message))
        case 3:
            return _damaged(random, msgspec.msgpack.encode(message))
        case _:
            return _foreign(random, message)


def _damaged(random: Random, data: bytes) -> bytes:
    """A payload with bytes flipped, cut off, inserted or repeated."""
    place = random.randrange(len(data))
    match random.randrange(5):
        case 0:
            return data[:place]
        case 1:
            return data[:place] + bytes([data[place] ^ 1 << random.randrange(8)]) + data[place + 1 :]
        case 2:
            return data[:place] + random.randbytes(random.randrange(1, 9)) + data[place:]
        case 3:
            return data + data
        case _:
            return data[:place] + LONG_INTEGER + data[place + 1 :]


def _foreign(random: Random, message: dict[str, Value]) -> bytes:
    """A payload of another format."""
    match random.randrange(5):
        case 0:
            return json.dumps(message, default=str).encode()
        case 1:
            return pickle.dumps(message)
        case 2:
            return random.randbytes(random.randrange(200))
        case 3:
            # A header that announces four thousand million elements, and deep nesting of empty values.
            return random.choice(
                [b"\xdd\xff\xff\xff\xff", b"\xdf\xff\xff\xff\xff", b"\xc6\xff\xff\xff\xff", b"\x91" * 100_000]
            )
        case _:
            return random.choice(FOREIGN)


def huge(random: Random, kind: Any, size: int) -> bytes:
    """A message of about `size` bytes, with one field far too long."""
    message = valid(random, kind)
    name = random.choice([each for each in message if each not in ("v", "type")] or ["extra"])
    return msgspec.msgpack.encode({**message, name: "a" * max(0, size - 200)})


HUGE_SIZES = (MAX_MESSAGE_BYTES - 100, MAX_MESSAGE_BYTES, MAX_MESSAGE_BYTES + 1000, 4 * MAX_MESSAGE_BYTES)
