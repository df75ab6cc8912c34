"""The table of keys is complete, and what is made from it is up to date."""

from __future__ import annotations

import inspect
from collections import Counter
from pathlib import Path
from typing import Any

import msgspec
import pytest
from typer.testing import CliRunner

from skillwing.dsl import load
from skillwing.services import protocol
from skillwing.services.managers.data_manager import DataManagerNode
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.protocol import Keys, Message
from skillwing.services.protocol_page.exchange import door, play
from skillwing.services.protocol_page.page import protocol_page
from skillwing.services.protocol_page.schema import channels_of, json_schema
from skillwing.services.terminal.cli import app
from skillwing.services.wire.channel import Each, Kind, Role
from skillwing.services.wire.channels import CHANNELS, keys_in
from skillwing.services.wire.messages import classes_of

ROOT = Path(__file__).parents[3]
NAME = "NAME"
CLOCKS = {protocol.CLOCK_KEY, f"{protocol.CLOCK_DONE_KEY}/{NAME}"}


def spelt_keys() -> set[str]:
    """Every key that `Keys` can spell, for one name."""
    keys = Keys("s")
    spelt: set[str] = set()
    for name, member in inspect.getmembers(Keys):
        if name.startswith("_") or name == "skillset":
            continue
        spelt.add(getattr(keys, name) if isinstance(member, property) else getattr(keys, name)(NAME))
    return spelt


def test_every_key_is_in_the_table() -> None:
    rows = {channel.spell(Keys("s"), NAME) for channel in CHANNELS}
    advice = "`Keys` in protocol.py and the rows in wire/channels.py differ in these. Add the missing one."
    assert rows ^ (spelt_keys() | CLOCKS) == set(), advice


def test_every_message_is_in_the_table() -> None:
    listed = {
        cls for channel in CHANNELS for kind in (channel.message, channel.reply) if kind for cls in classes_of(kind)
    }
    defined = {
        each
        for each in vars(protocol).values()
        if inspect.isclass(each) and issubclass(each, Message) and each is not Message
    }
    advice = "These messages of protocol.py have no row. Name them in one of wire/channels.py."
    assert defined - listed - {protocol.ErrorReply} == set(), advice
    assert listed <= defined


def test_no_key_is_offered_twice_for_the_same_use() -> None:
    uses = Counter((channel.pattern, channel.kind is Kind.QUERY) for channel in CHANNELS)
    assert {use: count for use, count in uses.items() if count > 1} == {}, "Leave one row of wire/channels.py for each."


@pytest.mark.parametrize("channel", CHANNELS, ids=lambda channel: f"{channel.kind}-{channel.pattern}")
def test_queries_have_replies_and_nothing_else_has(channel: Any) -> None:
    assert (channel.reply is not None) == (channel.kind is Kind.QUERY)
    assert (channel.message is None) == (channel.kind is Kind.TOKEN)
    assert channel.kind is Kind.QUERY or not channel.refusals


class Declarations:
    """A bus that only notes what a manager serves and publishes."""

    def __init__(self) -> None:
        self.served: set[str] = set()
        self.events: set[str] = set()
        self.name = "noted"
        self.identity = None

    def now(self) -> float:
        return 0.0

    def new_id(self) -> str:
        return self.name

    def wall(self) -> float:
        return 0.0

    def serve(self, key: str, on_request: object) -> None:
        del on_request
        self.served.add(key)

    def advertise(self, key: str, *, events: bool = False) -> Declarations:
        if events:
            self.events.add(key)
        return self

    def put(self, payload: bytes, attachment: bytes = b"") -> None:
        del payload, attachment

    def __getattr__(self, name: str) -> Any:
        return lambda *_, **__: None


def test_the_managers_serve_what_the_table_says() -> None:
    skillset = load(ROOT / "examples" / "rover" / "rover.skillset")
    for node, who in (
        (ResourceManagerNode(skillset), Role.RESOURCE_MANAGER),
        (DataManagerNode(skillset), Role.DATA_MANAGER),
    ):
        bus = Declarations()
        node.attach(bus)  # pyright: ignore[reportArgumentType]
        offered = [channel for channel in CHANNELS if channel.offered_by == (who,)]
        queries = {
            channel.spell(Keys("rover"), "*" if channel.each in (Each.EVENT, Each.DATUM) else NAME)
            for channel in offered
            if channel.kind is Kind.QUERY
        }
        events = {key for channel in offered if channel.kind is Kind.EVENTS for key in keys_in(skillset, channel)}
        assert bus.served == queries, "serve each query of the table in managers/resource_manager.py"
        assert bus.events == events | {Keys("rover").timeline}


def test_the_page_is_what_the_code_says() -> None:
    page = (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")
    assert page == protocol_page(), "run `make generate`"


def test_every_state_end_and_refusal_is_explained() -> None:
    page = protocol_page()
    for word in (*protocol.State, *protocol.Ending, *protocol.ErrorCode):
        assert page.count(f"\n| `{word}` | ") == 1


def test_the_exchange_shows_an_end_of_each_kind() -> None:
    said = [(each.how, msgspec.msgpack.decode(each.payload)) for each in play()]
    ends = [message["terminal"]["ending"] for _, message in said if message.get("terminal")]
    assert ends == ["S", "RI", "S"], "one succeeds, one is violated, and the first is asked for again"
    assert [message["code"] for how, message in said if how == "refuses"] == ["UNKNOWN_GOAL"]


def test_the_schema_resolves_and_names_every_message_of_a_channel() -> None:
    schema = json_schema()
    defined = {f"#/$defs/{name}" for name in schema["$defs"]}
    used = {each for channel in schema["channels"] for side in ("message", "reply") for each in channel[side]}
    assert used <= defined
    assert schema["$defs"]["StartGoal"]["required"] == ["goal_id", "inputs", "client", "schema"]
    assert schema["$defs"]["StartGoal"]["additionalProperties"] is False


def test_the_keys_of_a_skillset_are_spelt_out() -> None:
    told = channels_of(door())
    assert told["schema"] == door().schema_hash
    assert "door/skill/open/start" in [channel["key"] for channel in told["channels"]]
    assert not [channel["key"] for channel in told["channels"] if channel["key"] != channel["key"].lower()]


def test_the_command_prints_page_schema_and_keys() -> None:
    run = CliRunner()
    assert run.invoke(app, ["protocol"]).stdout == protocol_page()
    printed = run.invoke(app, ["protocol", "--json-schema"]).stdout
    assert msgspec.json.decode(printed) == msgspec.json.decode(msgspec.json.encode(json_schema()))
    rover = str(ROOT / "examples" / "rover" / "rover.skillset")
    assert "rover/skill/drive_to/start" in run.invoke(app, ["protocol", rover]).stdout
    assert msgspec.json.decode(run.invoke(app, ["protocol", rover, "--json"]).stdout)["skillset"] == "rover"
    assert "Leave out the FILE" in str(run.invoke(app, ["protocol", rover, "--json-schema"]).exception)
