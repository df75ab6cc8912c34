"""Start a skill and follow it to its end, with nothing but Zenoh and MessagePack.

This is the work of a client in another language, written from docs/protocol.md alone: nothing of Skillwing is
imported. Run the mocks of the rover in one terminal, and this in another one:

    $ skillwing mock examples/rover/rover.skillset
    $ skillwing status                                          # prints the address of the router
    $ skillwing protocol examples/rover/rover.skillset          # prints the schema hash
    $ python examples/plain_client/client.py tcp/127.0.0.1:PORT rover rover SCHEMA drive_to \
          '{"target": {"x": 1, "y": 2, "heading": 0}}'

A robot with keys has an address tls/HOST:PORT. Set SKILLWING_KEYS to the folder that you were given; its name is the
name in its certificate. Questions then carry that name: KEY/by/NAME.

It prints each change of the goal and of the robot's resources as one line of JSON, causes before effects. Ctrl-C
interrupts the goal, and waits until it has stopped. Exit codes: 0 the skill succeeded, 1 it ended otherwise, 2 it never
started, 3 it started and nobody answers any more.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import time
import uuid
from pathlib import Path
from typing import Any

import zenoh
from msgspec import msgpack

KEYS = Path(os.environ.get("SKILLWING_KEYS", "") if sys.argv[1:2] and sys.argv[1].startswith("tls/") else "")
"""Folder with a certificate; empty for an address that does not ask for one."""
REFUSAL = "application/vnd.skillwing.refusal+msgpack"
UNAVAILABLE = "UNAVAILABLE"
"""Code of the refusal after which the same request is to be sent again, as after a silence."""
UNKNOWN_GOAL = "UNKNOWN_GOAL"
"""Code of the refusal by a manager that does not know the goal: it was replaced, and the goal is lost."""
LOST = {"ending": "LOST", "result": None, "success": False}
PAUSE = 0.5
"""Time between two questions whether a lost goal is released [s]."""
PATIENCE = 2.0
"""Time without a message after which the client asks for the goal's state [s]."""
ORDER = ("VALIDATING", "DISPATCHING", "RUNNING", "INTERRUPTING", "TERMINATED")
"""States of a goal in their order. Replies and events come on different ways: an older state is no news."""
FIRST_PAUSE, LONGEST_PAUSE = 0.05, 1.0
"""Time from a silence to the next request [s]. It doubles with each silence. A question that nobody serves ends at
once."""
SILENCE = 10.0
"""Time without a reply after which the robot counts as gone [s]. A manager that is started again needs some of it."""
HELD = 20
"""Replies that a lost goal still holds its resources, after which it is printed as lost all the same."""


class RefusedError(Exception):
    """A typed refusal, after which nothing has changed. `code` is one of the protocol's table."""

    def __init__(self, refusal: dict[str, Any]) -> None:
        super().__init__(f"{refusal['message']} {refusal['help']}".strip())
        self.code = refusal["code"]


class SilenceError(Exception):
    """Error for a request without any reply."""


def open_session(endpoint: str, robot: str) -> zenoh.Session:
    """A session in the robot's namespace, with the keys of SKILLWING_KEYS for an address that asks for them."""
    link: dict[str, Any] = {"tx": {"lease": 2000}}
    if endpoint.startswith("tls/"):
        link["tls"] = {
            "root_ca_certificate": str(KEYS / "authority.pem"),
            "connect_certificate": str(KEYS / "certificate.pem"),
            "connect_private_key": str(KEYS / "key.pem"),
            "enable_mtls": True,
            "verify_name_on_connect": True,
        }
    config = {
        "mode": "client",
        "namespace": f"robot/{robot}",
        "connect": {"endpoints": [endpoint], "timeout_ms": 5000, "exit_on_failure": True},
        "scouting": {"multicast": {"enabled": False}},
        "transport": {"link": link},
    }
    return zenoh.open(zenoh.Config.from_json5(json.dumps(config)))


def ask(session: zenoh.Session, key: str, request: dict[str, Any]) -> dict[str, Any]:
    """Ask until a reply comes, and return it. Repetition is safe because the goal id stays the same."""
    asked = f"{key}/by/{KEYS.name}" if KEYS.name else key
    pause, end = FIRST_PAUSE, time.monotonic() + SILENCE
    while time.monotonic() < end:
        for reply in session.get(asked, payload=msgpack.encode(request), timeout=PATIENCE):
            if reply.ok is not None:
                return msgpack.decode(reply.ok.payload.to_bytes())
            if reply.err is not None and str(reply.err.encoding) == REFUSAL:
                refusal = RefusedError(msgpack.decode(reply.err.payload.to_bytes()))
                if refusal.code != UNAVAILABLE:
                    raise refusal
        time.sleep(pause)
        pause = min(2 * pause, LONGEST_PAUSE)
    raise SilenceError(f"Nobody answers on `{key}`. Does the robot run, and has its skillset this skill?")


class Skill:
    """A client of one skill of a robot."""

    def __init__(self, session: zenoh.Session, skillset: str, schema: str, skill: str) -> None:
        self._session = session
        self._schema = schema
        self._skillset = skillset
        self._skill = skill
        self._prefix = f"{skillset}/skill/{skill}"
        self._news: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()
        self._step, self._epoch = 0, ""
        """Number and epoch of the last step of the resource manager whose states were printed."""
        # Declared before the start, so that no message is missed.
        keys = (f"{skillset}/resource/step", f"{self._prefix}/status", f"{self._prefix}/progress")
        self._subscribers = [self._subscribe(key) for key in keys]
        self._print_states()

    def start(self, inputs: dict[str, Any]) -> str:
        """Start a goal of this skill, and return its id."""
        goal_id = str(uuid.uuid4())
        request = {"goal_id": goal_id, "inputs": inputs, "client": "plain_client", "schema": self._schema}
        self._news.put(ask(self._session, f"{self._prefix}/start", request))
        return goal_id

    def interrupt(self) -> None:
        """Let `follow` interrupt its goal. Does not wait, so that a signal handler may call it."""
        self._news.put(None)

    def follow(self, goal_id: str) -> dict[str, Any]:
        """Print all messages about a goal until it has ended; return its terminal answer."""
        said = -1
        while True:
            try:
                news = self._next_news(goal_id)
            except RefusedError as error:
                if error.code != UNKNOWN_GOAL:
                    raise
                news = self._lose(goal_id, str(error))
            if "number" in news:
                self._take_step(news)
            elif news["goal_id"] == goal_id and "state" not in news:
                _print(news)  # feedback
            elif news["goal_id"] == goal_id and ORDER.index(news["state"]) > said:
                if news.get("after_step", 0) > self._step:
                    # The status came before the step that it follows from. The states now contain that step.
                    self._print_states()
                _print(news)
                said = ORDER.index(news["state"])
                if news.get("terminal"):
                    return news["terminal"]

    def _lose(self, goal_id: str, reason: str) -> dict[str, Any]:
        """The end of a goal whose manager was replaced, after the states in which its resources are released."""
        for _ in range(HELD):
            (skill,) = ask(self._session, f"{self._skillset}/resource/ready", {"skill": self._skill})["skills"]
            running = skill["running"]
            if running is None or running["goal_id"] != goal_id:
                break
            time.sleep(PAUSE)
        else:
            reason += " Its resources may still be taken."
        self._print_states()
        return {"goal_id": goal_id, "state": "TERMINATED", "terminal": {**LOST, "reason": reason}}

    def _next_news(self, goal_id: str) -> dict[str, Any]:
        """The next message, or the reply to a request. The goal is over when its status says so, not before."""
        try:
            news = self._news.get(timeout=PATIENCE)
        except queue.Empty:
            return ask(self._session, f"{self._prefix}/goal", {"goal_id": goal_id})
        if news is None:
            return ask(self._session, f"{self._prefix}/interrupt", {"goal_id": goal_id, "client": "plain_client"})
        return news

    def _take_step(self, step: dict[str, Any]) -> None:
        """Print what a step of the resource manager changed, unless its states were printed already."""
        if (step["number"], step["epoch"]) == (self._step + 1, self._epoch):
            self._step = step["number"]
            for record in step["records"]:
                if record["kind"] == "resource":
                    _print({"step": step["number"], "resource": record["subject"], "state": record["after"]})
        elif step["number"] > self._step or step["epoch"] != self._epoch:
            self._print_states()

    def _print_states(self) -> None:
        """Ask for the states of all resources, and print them."""
        states = ask(self._session, f"{self._skillset}/resource/state", {})
        self._step, self._epoch = states["step"], states["epoch"]
        _print({"step": states["step"], "states": states["states"]})

    def _subscribe(self, key: str) -> zenoh.Subscriber[None]:
        callback = zenoh.handlers.Callback(self._hear, indirect=False)
        return self._session.declare_subscriber(key, callback)

    def _hear(self, sample: zenoh.Sample) -> None:
        self._news.put(msgpack.decode(sample.payload.to_bytes()))


def _print(line: dict[str, Any]) -> None:
    print(json.dumps(line), flush=True)  # noqa: T201 - the output of the program


def main() -> int:
    """Read the command line; see the top of this file."""
    if len(sys.argv) not in (6, 7):
        sys.stderr.write("usage: client.py ENDPOINT ROBOT SKILLSET SCHEMA SKILL [INPUTS AS JSON]\n")
        return 2
    endpoint, robot, skillset, schema, skill = sys.argv[1:6]
    try:
        inputs = json.loads(sys.argv[6]) if len(sys.argv) == 7 else {}
    except ValueError as error:
        sys.stderr.write(f"The inputs are no JSON: {error}. Write them as in '{{\"height\": 5}}'.\n")
        return 2
    with open_session(endpoint, robot) as session:
        started = False
        try:
            followed = Skill(session, skillset, schema, skill)
            signal.signal(signal.SIGINT, lambda *_: followed.interrupt())
            goal_id = followed.start(inputs)
            started = True
            terminal = followed.follow(goal_id)
        except (RefusedError, SilenceError) as error:
            sys.stderr.write(f"{error}\n")
            return 3 if started else 2
    return 0 if terminal["success"] else 1


if __name__ == "__main__":
    sys.exit(main())
