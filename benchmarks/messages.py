"""Cost of checks, encoding and decoding of the most frequent messages, as ratios to msgspec alone.

python benchmarks/messages.py [--write]
"""

from __future__ import annotations

import time
from collections.abc import Callable

import msgspec
from performance_page import machine, make_parser, table, write_section

from skillwing.onboard.topics.navigation import Navigation
from skillwing.services.protocol import ClockTick, DataSample, GoalStatus, Message, StartGoal, State, decode, encode

GOAL = "0199b0d4-0000-7000-8000-000000000001"
POSITION = {"x": 12.5, "y": -3.25, "z": 4.0}
MESSAGES: tuple[Message, ...] = (
    ClockTick(t=12.34),
    DataSample(name="position", value=POSITION, t=12.34),
    Navigation(
        t=12.34,
        position=(12.5, -3.25, 4.0),
        velocity=(1.5, 0.0, 0.0),
        quaternion=(1.0, 0.0, 0.0, 0.0),
        angular_velocity=(0.0, 0.0, 0.1),
        heading=0.0,
    ),
    StartGoal(goal_id=GOAL, inputs={"target": POSITION, "speed": 2.0}, client="mission", schema="0" * 64),
    GoalStatus(goal_id=GOAL, skill="goto", state=State.RUNNING, t=12.34),
)
CALLS = 2000
BLOCKS = 15


def _microseconds(call: Callable[[], object]) -> float:
    """The least processor time of a call among some blocks: whatever else the machine does can only add to it."""
    least = float("inf")
    for _ in range(BLOCKS):
        begun = time.process_time()
        for _ in range(CALLS):
            call()
        least = min(least, time.process_time() - begun)
    return 1e6 * least / CALLS


def _row(message: Message) -> list[str]:
    kind, payload = type(message), encode(message)
    encoder, decoder = msgspec.msgpack.Encoder(), msgspec.msgpack.Decoder(kind)
    out, out_alone = _microseconds(lambda: encode(message)), _microseconds(lambda: encoder.encode(message))
    back, back_alone = _microseconds(lambda: decode(payload, kind)), _microseconds(lambda: decoder.decode(payload))
    return [
        f"`{kind.__name__}`, {len(payload)} B",
        f"{out:.2f}",
        f"{back:.2f}",
        f"{out / out_alone:.1f}",
        f"{back / back_alone:.1f}",
    ]


def main() -> None:
    given = make_parser(__doc__).parse_args()
    heads = ("message", "encode, us", "decode, us", "to msgspec alone", "")
    body = f"""Every message is checked on its way out and in: its version, its size, its nesting, and that every number
is finite. What can be told from its bytes is told from them, which spares most messages a walk through their values.
{machine()}.

{table(heads, [_row(message) for message in MESSAGES])}"""
    write_section("messages.py", "Messages", body, write=given.write)


if __name__ == "__main__":
    main()
