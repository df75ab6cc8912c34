"""How the page of the protocol begins: connecting, payloads, and the rules of asking and following."""

from __future__ import annotations

from skillwing.services.bus import EVENT_HISTORY
from skillwing.services.bus.backlog import MIB, MOST_BYTES, MOST_REQUESTS, STREAM_BACKLOG
from skillwing.services.bus.zenoh_bus import REFUSAL, TIMEOUT_REPLY
from skillwing.services.bus.zenoh_session import LEASE
from skillwing.services.core.checks import LONGEST_GOAL_ID
from skillwing.services.protocol import MAX_MESSAGE_BYTES, MAX_NESTING, PROTOCOL_VERSION

WAITING = f"{MOST_BYTES // MIB} MiB"
OPENING = f"""\
# The wire protocol

Version {PROTOCOL_VERSION}. What the processes of a robot say to each other, and what a client in any language has to
say to take part. This page is made from the code by `skillwing protocol > docs/protocol.md`, and a test keeps it so;
`skillwing protocol --json-schema` prints the messages and keys for programs. What the messages *mean* is told in
[semantics.md](semantics.md). [examples/plain_client](../examples/plain_client/client.py) is a client that was written
from this page alone.

## Connecting

Skillwing speaks [Zenoh](https://zenoh.io) 1.x. A robot is one router with clients around it; `skillwing status` tells
its address. Open a session with:

| setting | value |
|---|---|
| `mode` | `"client"` |
| `connect/endpoints` | the router's address, `tcp/HOST:PORT` |
| `namespace` | `robot/NAME`, after which all keys below are relative to the robot |
| `scouting/multicast/enabled` | `false` |
| `transport/link/tx/lease` | {LEASE * 1000:.0f}, in milliseconds: how soon others notice that you hang |

The skillset's name begins every key, and its *schema hash* goes into every start, so that a client never flies a robot
with another skillset than it was made for. `skillwing protocol FILE.skillset` prints both, and all keys there are.

## Payloads

- Each payload is one [MessagePack](https://msgpack.org) map from field names to values.
- Fields with a default may be left out. Unknown fields, wrong types, NaN and infinity are refused, and so are payloads
  of more than {MAX_MESSAGE_BYTES} bytes and those nested more than {MAX_NESTING} levels deep.
- `v` is the sender's protocol version; another one than {PROTOCOL_VERSION} is refused.
- Where one of several messages is expected, the field `type` tells which it is.
- `t` is robot time in seconds: Unix time, or simulated time where `fl/clock` is published.
- Enumerations go as texts. An `int` is accepted where a `float` is expected, not the other way round.
- Goal ids are chosen by the client: 1 to {LONGEST_GOAL_ID} characters that nobody else will choose, best a
  [UUIDv7](https://www.rfc-editor.org/rfc/rfc9562).
- `record` and `cause` are ids of records of the timeline. Pass on the `record` of what made you act as the `cause` of
  what you ask for, and your action shows in the right chain.

## Asking, and being told

**Queries.** Send a Zenoh query with the request as its payload. Three things may come back:

| what | is |
|---|---|
| a reply | the message that the table names |
| an error reply with the encoding `{REFUSAL}` | a refusal: [`ErrorReply`](#errorreply). Nothing has changed. |
| nothing, or any other error reply (`{TIMEOUT_REPLY.decode()}` for one) | **silence. It never means "no".** |

After silence the request may have been carried out, or be carried out later; so may one that was refused as `INTERNAL`.
Ask again with the same goal id: it is harmless, for the same id never runs twice. Give a start a `deadline`, so that
one that is delivered late is refused.

**Events** are published by Zenoh's advanced publishers, with a cache of {EVENT_HISTORY} publications and heartbeats. An
advanced subscriber with `history` and `recovery` gets each of them exactly once, also those from before it came. A
plain subscriber gets what is published while it is connected. **Streams** are plain publications, some of which may be
lost.

**What waits for a busy process** is bounded, and the newest is kept:

| kind | at most | beyond that |
|---|---|---|
| streams | {STREAM_BACKLOG} samples of a subscription, {WAITING} of all subscriptions | the oldest sample is dropped |
| events | {WAITING} of all subscriptions | the oldest event is dropped, and the log reports it |
| queries | {MOST_REQUESTS} queries, and {WAITING} of them | the query is refused as `UNAVAILABLE` |

When the bytes are too many, the subscription with the most waiting bytes loses its oldest sample: a flood on one key
costs the subscriptions to other keys nothing. Payloads of more than {MAX_MESSAGE_BYTES} bytes are no events and never
wait. Answers to the process's own queries always find room.

**Following a goal.** Subscribe to `status` first, then start. A goal is over when a status has a `terminal`, and not
before. If statuses stay away, ask `goal`. If that stays unanswered and the manager's `alive` token is gone, the goal is
lost: the resource manager frees what it held within about a second.

**Owning a goal.** Declare a liveliness token `SKILLSET/alive/client/NAME` and give `client/NAME` as the `owner`: when
your process is gone the goal is interrupted, unless the skill says otherwise. Without an owner it goes on.
"""
