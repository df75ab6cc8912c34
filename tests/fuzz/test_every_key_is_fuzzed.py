"""Every key with a server or a subscriber is fuzzed."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path

import pytest
from endpoints import KEYS, PUBLICATIONS, QUERIES
from fuzz_stage import MOCKED, REAL, FuzzStage, nodes_of_the_m600, nodes_of_the_mocked_m600

from skillwing.onboard.interface.table import TOPICS
from skillwing.onboard.topics.video import VIDEO_ENCODER
from skillwing.services.bus.keys import matches
from skillwing.services.protocol import CLOCK_DONE_KEY, CLOCK_KEY, Keys

ONLY_OBSERVED = {
    KEYS.alive("x"): "a liveliness token has no payload",
    KEYS.candidate("x"): "a liveliness token, too",
    KEYS.leader("x"): "a liveliness token, too",
    VIDEO_ENCODER: "only a running stream listens",
    **{topic.key: "no process uses it" for topic in TOPICS if not topic.used_by},
}
ADVICE = "Add an endpoint to tests/fuzz/endpoints.py, or a line to ONLY_OBSERVED if no process reads the key"
OF_THE_BUS = {CLOCK_KEY, f"{CLOCK_DONE_KEY}/**"}
"""Keys of robot time: the network's own in one process; over Zenoh the bus subscribes to them."""


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FuzzStage]:
    folder: Path = tmp_path_factory.mktemp("run")
    yield FuzzStage({REAL: nodes_of_the_m600(folder), MOCKED: nodes_of_the_mocked_m600()})


def test_every_service_is_fuzzed(stage: FuzzStage) -> None:
    served = stage.served()
    missing = {key for key in served if not any(matches(key, endpoint.key) for endpoint in QUERIES)}
    assert not missing, f"No fuzz test asks {sorted(missing)}. {ADVICE}."
    assert len(served) > 40, "few services: is everybody there?"


def test_every_subscription_is_fuzzed(stage: FuzzStage) -> None:
    subscribed = stage.subscribed() | OF_THE_BUS
    missing = {key for key in subscribed if not any(matches(key, endpoint.key) for endpoint in PUBLICATIONS)}
    assert not missing, f"No fuzz test publishes on {sorted(missing)}. {ADVICE}."


def test_nothing_is_fuzzed_that_nobody_takes(stage: FuzzStage) -> None:
    served, subscribed = stage.served(), stage.subscribed() | OF_THE_BUS
    idle = [each.key for each in QUERIES if not any(matches(key, each.key) for key in served)]
    idle += [each.key for each in PUBLICATIONS if not any(matches(key, each.key) for key in subscribed)]
    assert idle == [], f"No process takes {idle}. Remove these endpoints from tests/fuzz/endpoints.py."


def test_every_key_of_the_protocol_is_fuzzed() -> None:
    known = {endpoint.key for endpoint in (*QUERIES, *PUBLICATIONS)} | ONLY_OBSERVED.keys()
    unknown = {
        name for name, pattern in keys_of_the_protocol().items() if not any(matches(pattern, key) for key in known)
    }
    assert not unknown, f"No fuzz test knows {sorted(unknown)}. {ADVICE}."


def keys_of_the_protocol() -> dict[str, str]:
    """Keys of `Keys` and of the functional layer's topics by name, with a wildcard for each variable part."""
    found = {topic.pattern: topic.spell(KEYS, "*") for topic in TOPICS}
    for name, member in inspect.getmembers(Keys):
        if isinstance(member, property):
            found[name] = getattr(KEYS, name)
        elif inspect.isfunction(member) and not name.startswith("_"):
            found[name] = member(KEYS, "*")
    return found
