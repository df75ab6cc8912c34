"""Host process of one node or several: buses, liveliness, signals, log.

    python -m skillwing.services.processes.node_host --process skill/drive --robot forklift --connect tcp/127.0.0.1:7447
    python -m skillwing.services.processes.node_host --name echo --factory package.module:function --options '{}' ...

The first form takes a process from the robot's table, the second describes it. Repeat `--process`, or `--name` with
`--factory`, `--options` and `--alive`, for further nodes of the same process. Defaults come from the environment:
SKILLWING_CONNECT, SKILLWING_ROBOT, SKILLWING_TOPOLOGY, SKILLWING_KEYS, SKILLWING_HEARTBEAT, and the run's options of
run_options.py.

It runs until SIGTERM or SIGINT, or with `--parent-pipe` until its standard input ends, or until one of its nodes ends.
lifetime.py has its exit codes.
"""

from __future__ import annotations

import argparse
import gc
import json
import logging
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast, get_args

from skillwing.dsl import SkillsetError, UnknownNameError
from skillwing.services.bus import Node, Topology
from skillwing.services.bus.address import FORM, is_address
from skillwing.services.bus.clock import LAG, Clock, FollowedClock, LockstepClock, PacedClock, WallClock
from skillwing.services.disk import discard_unwritten
from skillwing.services.errors import InvalidOptionError, PassingError, SkillwingError
from skillwing.services.options import imported
from skillwing.services.processes.checked_skillsets import read_skillsets
from skillwing.services.processes.hosting import Heartbeat, HostedNode, NetworkAddress, give_up, live, live_together
from skillwing.services.processes.lifetime import EXIT_CONFIGURATION, EXIT_CRASHED, EXIT_PASSING, Lifetime
from skillwing.services.processes.run_options import run_options
from skillwing.services.protocol import Keys
from skillwing.services.robot import ClockKind, ProcessSpec, find_robot

SWITCH_INTERVAL = 0.0005
"""Seconds that one thread may keep the interpreter. With the default of 5 ms, Zenoh's callbacks wait too long."""
LOG_FORMAT = "%(asctime)s.%(msecs)03d %(levelname)s %(name)s: %(message)s"
SHARED_LOG_FORMAT = "%(asctime)s.%(msecs)03d %(levelname)s [%(threadName)s] %(name)s: %(message)s"
"""Format for several nodes in one log: each line names its thread, which has the name of the node."""
logger = logging.getLogger("skillwing.node_host")


def main(arguments: list[str] | None = None) -> int:
    """Host nodes until their end; returns the exit code."""
    options = _parse(arguments)
    nodes = len(options.process or options.name)
    if options.skillsets:
        read_skillsets(sys.stdin.fileno(), options.skillsets)
    lifetime = Lifetime(parent_pipe=options.parent_pipe)
    logging.basicConfig(
        stream=sys.stderr,
        level=logging.INFO,
        format=LOG_FORMAT if nodes == 1 else SHARED_LOG_FORMAT,
        datefmt="%H:%M:%S",
    )
    sys.setswitchinterval(SWITCH_INTERVAL)
    hosted: list[HostedNode] = []
    who = ""
    try:
        robot, clock_kind, specs = _resolve(options)
        for spec, alive in specs:
            who = spec.name if nodes > 1 else ""
            node = make_node(spec)
            clock = make_clock(node, clock_kind, spec.options, options.unix_offset)
            hosted.append(HostedNode(spec.name, node, clock, alive))
    except PassingError as error:
        return give_up(error, EXIT_PASSING, who)
    except (SkillwingError, SkillsetError, UnknownNameError, OSError) as error:
        return give_up(error, EXIT_CONFIGURATION, who)
    except Exception:
        logger.exception("The node %scould not be made.", f"{who} " if who else "")
        return EXIT_CRASHED
    address = NetworkAddress(robot, options.connect, options.topology, options.keys)
    # All modules stay. A full garbage collection would walk through them, and stop the nodes for up to 25 ms.
    gc.freeze()
    heartbeat = Heartbeat(options.heartbeat, [node.name for node in hosted]) if options.heartbeat else None
    if nodes == 1:
        return live(hosted[0], address, lifetime, heartbeat)
    return live_together(hosted, address, lifetime, heartbeat)


def make_node(spec: ProcessSpec) -> Node:
    """Call the factory that the spec names.

    Raises InvalidOptionError for a factory that does not exist, a missing package, or an option that does not fit.
    """
    factory = imported({"factory": spec.factory}, "factory")
    try:
        return factory(spec.resolved().options)
    except ValueError as error:
        raise InvalidOptionError("options", f"`{spec.factory}` cannot use its options: {error}") from error


def make_clock(node: Node, kind: ClockKind, options: dict[str, Any], unix_offset: float | None = None) -> Clock:
    """The clock of a node. The owner of robot time sets it, with `factor` of its options; other nodes follow.

    A factor of 0 is as fast as the followers keep up: step by step for nodes with a true `closes_loop`, within `LAG`
    for all others. unix_offset: see `WallClock`.
    """
    if node.owns_clock:
        factor = float(options.get("factor", 1.0))
        return PacedClock(factor) if factor > 0.0 else LockstepClock()
    lag = 0.0 if getattr(node, "closes_loop", False) else LAG
    return FollowedClock(lag=lag) if kind == "robot" else WallClock(offset=unix_offset)


# --- command line ----------------------------------------------------------------------------------------------------


def _parse(arguments: list[str] | None) -> argparse.Namespace:
    environment = os.environ.get
    parser = argparse.ArgumentParser(
        prog="skillwing.services.processes.node_host", description="Host one node of a robot."
    )
    parser.add_argument("--process", action="append", metavar="NAME", help="a process of the robot's table")
    parser.add_argument("--name", action="append", help="the node's name, if it is not in the table")
    parser.add_argument("--factory", action="append", metavar="MODULE:FUNCTION", help="factory of the node")
    parser.add_argument("--options", action="append", metavar="JSON", help="arguments of the factory")
    parser.add_argument("--alive", action="append", metavar="KEY", help="liveliness token to hold while the node runs")
    parser.add_argument("--connect", metavar="tcp/HOST:PORT", default=environment("SKILLWING_CONNECT"))
    parser.add_argument(
        "--robot", default=environment("SKILLWING_ROBOT"), help="the robot: name, folder, package.module:ROBOT"
    )
    parser.add_argument(
        "--topology",
        default=environment("SKILLWING_TOPOLOGY") or "router",
        metavar="router|mesh",
        help="processes meet at the router, or each connects to each on this machine",
    )
    keys = environment("SKILLWING_KEYS")
    parser.add_argument(
        "--keys", type=Path, metavar="DIR", default=Path(keys) if keys else None, help="folder with certificates"
    )
    parser.add_argument("--clock", choices=("wall", "robot"), help="default: wall, or as the table says")
    parser.add_argument(
        "--unix-offset", type=float, metavar="SECONDS", help="wall time minus the monotonic clock's; default: of now"
    )
    parser.add_argument("--heartbeat", type=Path, metavar="FILE", default=environment("SKILLWING_HEARTBEAT"))
    parser.add_argument("--parent-pipe", action="store_true", help="end when standard input ends")
    parser.add_argument(
        "--skillsets", type=int, metavar="BYTES", default=0, help="standard input begins with checked skillsets"
    )
    options = parser.parse_args(arguments)
    if not options.connect or not options.robot:
        parser.error("both --connect and --robot have to be given, here or by the environment")
    if bool(options.process) == bool(options.name and options.factory):
        parser.error("give either --process, or --name and --factory")
    if not is_address(options.connect):
        parser.error(f"`{options.connect}` is no address of a router: write {FORM}")
    if options.topology not in get_args(Topology):
        parser.error(f"the topology is `router` or `mesh`, not `{options.topology}`")
    _require_as_many(parser, options)
    return options


def _require_as_many(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """Require as many of these options as nodes: their order assigns them."""
    nodes = options.process or options.name
    if len(set(nodes)) < len(nodes):
        parser.error("each node of a process has a name of its own")
    for word in ("options", "alive", *(() if options.process else ("factory",))):
        given = getattr(options, word)
        if given and len(given) != len(nodes):
            parser.error(f"--{word} is given {len(given)} times for {len(nodes)} nodes; give it once for each")


def _resolve(options: argparse.Namespace) -> tuple[str, ClockKind, Sequence[tuple[ProcessSpec, str | None]]]:
    """The namespace, the clock, and each node with its liveliness key."""
    if options.process:
        robot = find_robot(options.robot)
        run = run_options(os.environ)
        specs = [robot.process(name, run) for name in options.process]
        # The file name is the skillset's name. Reading the file would cost every process a parser.
        keys = Keys(robot.skillset.stem)
        alive = options.alive or [keys.alive(spec.name) for spec in specs]
        return robot.name, options.clock or robot.clock, list(zip(specs, alive, strict=True))
    given = options.options or ["{}"] * len(options.name)
    named = zip(options.name, options.factory, given, strict=True)
    specs = [ProcessSpec(name, factory, _json_object(text)) for name, factory, text in named]
    alive = options.alive or [None] * len(specs)
    return options.robot, options.clock or "wall", list(zip(specs, alive, strict=True))


def _json_object(text: str) -> dict[str, Any]:
    try:
        value = json.loads(text)
    except ValueError as error:
        raise InvalidOptionError("options", f"The options are no JSON: {error}. Write an object: {{...}}.") from error
    if not isinstance(value, dict):
        raise InvalidOptionError("options", f"The options are `{text}`; write a JSON object: {{...}}.")
    return cast(dict[str, Any], value)


if __name__ == "__main__":
    ended_with = main()
    discard_unwritten()
    sys.exit(ended_with)
