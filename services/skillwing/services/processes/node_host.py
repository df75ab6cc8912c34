"""The process around one node: bus, liveliness, signals, log.

    python -m skillwing.services.processes.node_host --process skill/takeoff --robot m600 --connect tcp/127.0.0.1:7447
    python -m skillwing.services.processes.node_host --name echo --factory package.module:function --options '{}' ...

The first form looks a process up in the robot's table, the second names it outright. What is not given is taken from
the environment: SKILLWING_CONNECT, SKILLWING_ROBOT, SKILLWING_HEARTBEAT, and for the run SKILLWING_SEED,
SKILLWING_SPEED, SKILLWING_FAULTS (JSON), SKILLWING_RUN_DIR, SKILLWING_DURABLE (1 or 0) and SKILLWING_VIEWER_URL.

It runs until SIGTERM or SIGINT, or with `--parent-pipe` until its standard input ends. Exit codes: 0 it was told to
end, 69 no router answers, 70 the node crashed (the log has the traceback), 74 what it needs cannot be read or written
just now, 76 another process has taken its place, 78 it was told to do something it cannot.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import sys
from pathlib import Path
from typing import Any, cast

from skillwing.dsl import SkillsetError, UnknownNameError
from skillwing.services.bus import Node
from skillwing.services.bus.clock import Clock, FollowedClock, LockstepClock, PacedClock, WallClock
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.bus.zenoh_session import RouterUnreachableError
from skillwing.services.errors import InvalidOptionError, PassingError, SkillwingError, WrongSkillsetError
from skillwing.services.options import imported
from skillwing.services.processes.lifetime import (
    EXIT_CONFIGURATION,
    EXIT_CRASHED,
    EXIT_OK,
    EXIT_PASSING,
    EXIT_REPLACED,
    EXIT_UNREACHABLE,
    Lifetime,
)
from skillwing.services.protocol import Keys
from skillwing.services.robot import ClockKind, ProcessSpec, find_robot

SWITCH_INTERVAL = 0.0005
"""Seconds that one thread may keep the interpreter: with the default of 5 ms Zenoh's callbacks wait for it too long."""
HEARTBEAT_PERIOD = 1.0
LAG = 0.1
"""Robot seconds by which a process may be behind where time runs as fast as its followers keep up: one period of the
fastest data."""
RUN_OPTIONS = {
    "seed": int,
    "speed": float,
    "faults": json.loads,
    "run_dir": str,
    "durable": int,
    "viewer_url": str,
}

logger = logging.getLogger("skillwing.node_host")


def main(arguments: list[str] | None = None) -> int:
    """Host a node until its end; returns the process's exit code."""
    options = _parse(arguments)
    lifetime = Lifetime(parent_pipe=options.parent_pipe)
    logging.basicConfig(
        stream=sys.stderr,
        level=logging.INFO,
        format="%(asctime)s.%(msecs)03d %(levelname)s %(name)s: %(message)s",
        datefmt="%H:%M:%S",
    )
    sys.setswitchinterval(SWITCH_INTERVAL)
    try:
        robot, spec, clock_kind, alive_key = _resolve(options)
        node = make_node(spec)
        clock = make_clock(node, clock_kind, spec.options, options.unix_offset)
        bus = ZenohBus(spec.name, robot, options.connect, clock)
    except RouterUnreachableError as error:
        return _give_up(error, EXIT_UNREACHABLE)
    except PassingError as error:
        return _give_up(error, EXIT_PASSING)
    except (SkillwingError, SkillsetError, UnknownNameError, OSError) as error:
        return _give_up(error, EXIT_CONFIGURATION)
    except Exception:
        logger.exception("The node could not be made.")
        return EXIT_CRASHED
    return _host(bus, node, lifetime, alive_key, options.heartbeat)


def make_node(spec: ProcessSpec) -> Node:
    """Call the factory that the spec names.

    Raises InvalidOptionError where there is no such factory, a package that it needs is not installed, or an option
    means nothing to it.
    """
    factory = imported({"factory": spec.factory}, "factory")
    try:
        return factory(spec.options)
    except ValueError as error:
        raise InvalidOptionError("options", f"`{spec.factory}` cannot use its options: {error}") from error


def make_clock(node: Node, kind: ClockKind, options: dict[str, Any], unix_offset: float | None = None) -> Clock:
    """The owner of robot time makes it, at `factor` of its options; everybody else follows it, or the wall clock.

    A factor of 0 is as fast as the followers keep up. Those whose node has an attribute `closes_loop` that is true keep
    up step by step, all others within `LAG`. unix_offset: see `WallClock`.
    """
    if node.owns_clock:
        factor = float(options.get("factor", 1.0))
        return PacedClock(factor) if factor > 0.0 else LockstepClock()
    lag = 0.0 if getattr(node, "closes_loop", False) else LAG
    return FollowedClock(lag=lag) if kind == "robot" else WallClock(offset=unix_offset)


def _host(bus: ZenohBus, node: Node, lifetime: Lifetime, alive_key: str | None, heartbeat: Path | None) -> int:
    """Run an attached node until the process has to end."""
    lifetime.on_end(lambda: bus.post(lambda: None))
    try:
        node.attach(bus)
        if alive_key is not None:
            bus.declare_alive(alive_key)
        if heartbeat is not None:
            _beat(bus, heartbeat)
        logger.info("%s runs", bus.name)
        bus.run_until(lambda: lifetime.over)
        if bus.closed:
            return EXIT_REPLACED
        node.detach()
    except WrongSkillsetError as error:
        return _give_up(error, EXIT_CONFIGURATION)
    except Exception:
        logger.exception("%s crashed", bus.name)
        return EXIT_CRASHED
    finally:
        bus.close()
    logger.info("%s ended", bus.name)
    return EXIT_OK


def _beat(bus: ZenohBus, file: Path) -> None:
    """Touch a file from the node's own thread once a second: an old one tells a crash and a hang alike."""
    file.touch()
    bus.after(HEARTBEAT_PERIOD, lambda: _beat(bus, file), wall=True)


def _give_up(error: Exception, code: int) -> int:
    sys.stderr.write(f"{error}\n")
    return code


# --- what the command line says --------------------------------------------------------------------------------------


def _parse(arguments: list[str] | None) -> argparse.Namespace:
    environment = os.environ.get
    parser = argparse.ArgumentParser(
        prog="skillwing.services.processes.node_host", description="Host one node of a robot."
    )
    parser.add_argument("--process", metavar="NAME", help="a process of the robot's table")
    parser.add_argument("--name", help="the node's name, if it is not in the table")
    parser.add_argument("--factory", metavar="MODULE:FUNCTION", help="what makes the node")
    parser.add_argument("--options", metavar="JSON", default="{}", help="what the factory is called with")
    parser.add_argument("--connect", metavar="tcp/HOST:PORT", default=environment("SKILLWING_CONNECT"))
    parser.add_argument(
        "--robot", default=environment("SKILLWING_ROBOT"), help="the robot: name, folder, package.module:ROBOT"
    )
    parser.add_argument("--clock", choices=("wall", "robot"), help="default: wall, or as the table says")
    parser.add_argument(
        "--unix-offset", type=float, metavar="SECONDS", help="wall time minus the monotonic clock's; default: of now"
    )
    parser.add_argument("--alive", metavar="KEY", help="liveliness token to hold while the node runs")
    parser.add_argument("--heartbeat", type=Path, metavar="FILE", default=environment("SKILLWING_HEARTBEAT"))
    parser.add_argument("--parent-pipe", action="store_true", help="end when standard input ends")
    options = parser.parse_args(arguments)
    if not options.connect or not options.robot:
        parser.error("both --connect and --robot have to be given, here or by the environment")
    if bool(options.process) == bool(options.name and options.factory):
        parser.error("give either --process, or --name and --factory")
    return options


def _resolve(options: argparse.Namespace) -> tuple[str, ProcessSpec, ClockKind, str | None]:
    """In whose namespace to run what, by which clock, and its liveliness key."""
    if options.process:
        robot = find_robot(options.robot)
        spec = robot.process(options.process, run_options(os.environ))
        # The skillset's file is called after it; reading the file for its name would cost every process a parser.
        alive_key = options.alive or Keys(robot.skillset.stem).alive(spec.name)
        return robot.name, spec, options.clock or robot.clock, alive_key
    return (
        options.robot,
        ProcessSpec(options.name, options.factory, _json_object(options.options)),
        options.clock or "wall",
        options.alive,
    )


def run_options(environment: os._Environ[str] | dict[str, str]) -> dict[str, Any]:
    """The options of the run that SKILLWING_* variables give; raises InvalidOptionError for one that means nothing."""
    found: dict[str, Any] = {}
    for option, convert in RUN_OPTIONS.items():
        variable = f"SKILLWING_{option.upper()}"
        text = environment.get(variable)
        if text:
            try:
                found[option] = convert(text)
            except ValueError as error:
                raise InvalidOptionError(option, f"{variable} is `{text}`, which cannot be read: {error}.") from error
    return found


def _json_object(text: str) -> dict[str, Any]:
    try:
        value = json.loads(text)
    except ValueError as error:
        raise InvalidOptionError("options", f"The options are no JSON: {error}. Write an object: {{...}}.") from error
    if not isinstance(value, dict):
        raise InvalidOptionError("options", f"The options are `{text}`; write a JSON object: {{...}}.")
    return cast(dict[str, Any], value)


if __name__ == "__main__":
    sys.exit(main())
