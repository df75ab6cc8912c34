"""`skillwing data`: the latest value of each datum."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.text import Text

from skillwing.services.protocol import DataReading, QueryData
from skillwing.services.terminal.completion import data as data_names
from skillwing.services.terminal.connection import JsonOption, RobotOption, connect
from skillwing.services.terminal.output import make_console, print_json, print_table, value_text


def data(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="One datum; all if left out.", autocompletion=data_names)
    ] = None,
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show the latest values of the robot's data with their age in seconds, and mark stale ones."""
    with connect(robot, wait_for_clock=False) as system:
        items = [system.skillset.datum(name)] if name else system.skillset.data
        readings = [system.ask(system.keys.data(item.name), QueryData(), DataReading) for item in items]
        if as_json:
            rows = [
                {"name": each.name, "value": each.value, "t": each.t, "age": each.age, "stale": each.stale}
                for each in readings
            ]
            print_json(rows[0] if name else rows)
            return
        units = {item.name: item.unit or "" for item in items}
        print_table(
            make_console(),
            ("DATUM", "VALUE", "UNIT", "AGE", ""),
            [
                (
                    each.name,
                    value_text(each.value),
                    units[each.name],
                    "-" if each.age is None else f"{each.age:.1f} s",
                    Text("stale" if each.age is not None else "never received", style="red") if each.stale else "",
                )
                for each in readings
            ],
        )
