"""Cost of checks, encoding and decoding of the most frequent messages, as ratios to msgspec alone.

python benchmarks/messages.py [--write]
"""

from __future__ import annotations

from checkouts import ROOT
from message_costs import run
from performance_page import machine, make_parser, table, write_section


def _row(name: str, cost: dict[str, float]) -> list[str]:
    return [
        f"`{name}`, {cost['bytes']} B",
        f"{cost['encode']:.2f}",
        f"{cost['decode']:.2f}",
        f"{cost['encode'] / cost['encode alone']:.1f}",
        f"{cost['decode'] / cost['decode alone']:.1f}",
    ]


def main() -> None:
    given = make_parser(__doc__).parse_args()
    heads = ("message", "encode, us", "decode, us", "to msgspec alone", "")
    body = f"""Every message is checked on its way out and in: its version, its size, its nesting, and that every number
is finite. What can be told from its bytes is told from them, which spares most messages a walk through their values.
{machine()}.

{table(heads, [_row(name, cost) for name, cost in run(ROOT).items()])}"""
    write_section("messages.py", "Messages", body, write=given.write)


if __name__ == "__main__":
    main()
