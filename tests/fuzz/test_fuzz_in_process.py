"""Bad input to every key of the m600 in one process: no callback raises, and every question gets a typed answer.

`make fuzz` sends more payloads, and sends them to real processes too.
"""

from __future__ import annotations

import logging
from pathlib import Path
from random import Random
from typing import Any

import msgspec
import pytest
from endpoints import PUBLICATIONS, QUERIES, SKILLSET, WORDS, Endpoint
from fuzz_stage import MOCKED, REAL, FuzzStage, nodes_of_the_m600, nodes_of_the_mocked_m600
from hypothesis import given
from hypothesis import strategies as st
from payloads import Spoiler, long_list, payload, valid, wide

from skillwing.services.bus import Answered, Refused
from skillwing.services.core.ends import LOCAL_OUTCOMES
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.protocol import (
    CLOCK_KEY,
    AttachManager,
    BeginGoal,
    Ended,
    FireEvent,
    FireExtern,
    GoalCall,
    ProtocolError,
    RecordOutcome,
    StartGoal,
    Terminal,
    decode,
    encode,
)

ENDPOINTS = (*QUERIES, *PUBLICATIONS)
IN_PROCESS = tuple(endpoint for endpoint in ENDPOINTS if endpoint.key != CLOCK_KEY)
"""Endpoints without the clock, which the network owns in one process."""


@given(st.sampled_from(ENDPOINTS), st.randoms(use_true_random=False))
def test_whatever_comes_in_is_a_message_or_a_protocol_error(endpoint: Endpoint, random: Random) -> None:
    content = payload(random, endpoint.kind, WORDS)
    try:
        message = decode(content, endpoint.kind)
    except ProtocolError as error:
        assert str(error)
    else:
        assert decode(encode(message), endpoint.kind) == message


@given(st.lists(st.randoms(use_true_random=False), min_size=1, max_size=12))
def test_the_resource_core_answers_or_refuses_and_stays_whole(randoms: list[Random]) -> None:
    numbers = iter(range(10_000))
    core = ResourceCore(SKILLSET, source="test", new_record_id=lambda: f"record {next(numbers)}")
    states = {resource.name: resource.states for resource in SKILLSET.resources}
    kinds: tuple[Any, ...] = (GoalCall, GoalCall, FireExtern, FireEvent, AttachManager)
    for now, random in enumerate(randoms):
        try:
            call = decode(payload(random, random.choice(kinds), WORDS), random.choice(kinds))
        except ProtocolError:
            continue
        before = core.last_step
        try:
            core.step(call, float(now))
        except RefusedError as refusal:
            assert core.last_step == before
            assert encode(refusal.reply)
        assert all(state in states[name] for name, state in core.states.items())


@given(st.randoms(use_true_random=False), st.booleans())
def test_a_local_outcome_is_stored_as_it_was_sent_or_refused(random: Random, plausible: bool) -> None:
    """Plausible outcomes are drawn too: the core accepts hardly any outcome with random fields."""
    numbers = iter(range(10_000))
    core = ResourceCore(SKILLSET, source="test", new_record_id=lambda: f"record {next(numbers)}")
    core.step(AttachManager(manager="skill/x", incarnation="one"), 0.0)
    skill, schema = SKILLSET.skills[0].name, SKILLSET.schema_hash
    begin = BeginGoal(goal_id="g", skill=skill, inputs={}, manager="skill/x", owner="me", schema=schema)
    terminal = valid(random, Terminal, WORDS)
    fields = valid(random, RecordOutcome, WORDS) | {"goal_id": "g", "skill": skill, "manager": "skill/x"}
    fields |= {"incarnation": "one", "terminal": terminal}
    if plausible:
        terminal |= {"ending": random.choice(LOCAL_OUTCOMES), "result": None, "success": False, "output": None}
        terminal |= {"forced": False}
        fields |= {"terminal": terminal}
    request = decode(msgspec.msgpack.encode(fields), RecordOutcome)
    try:
        ended = core.step(request, 1.0).reply
    except RefusedError as refusal:
        assert not plausible
        assert encode(refusal.reply)
        return
    assert decode(encode(ended), Ended) == ended
    assert isinstance(ended, Ended)
    assert ended.terminal == request.terminal
    assert core.step(begin, 2.0).reply == ended


@given(st.sampled_from(ENDPOINTS), st.randoms(use_true_random=False))
def test_valid_messages_are_valid(endpoint: Endpoint, random: Random) -> None:
    """Invalid messages would not get beyond the decoder."""
    message = valid(random, endpoint.kind, ["x"])
    try:
        decode(msgspec.msgpack.encode(message), endpoint.kind)
    except ProtocolError as error:
        # Values of the right type may still lie outside a field's range.
        assert "`float`" in str(error) or "`int`" in str(error), str(error)


@pytest.mark.parametrize("seed", [1])
def test_no_callback_raises_and_every_question_is_answered(tmp_path: Path, seed: int) -> None:
    logging.disable(logging.CRITICAL)
    try:
        stage = FuzzStage({REAL: nodes_of_the_m600(tmp_path), MOCKED: nodes_of_the_mocked_m600()})
        random = Random(seed)
        for endpoint in IN_PROCESS:
            for _ in range(4):
                stage.throw(random, endpoint)
        stage.run(2.5)
    finally:
        logging.disable(logging.NOTSET)
    assert not stage.findings, "\n".join(map(str, stage.findings[:5]))
    assert not stage.silent
    assert not stage.internal
    assert stage.refused > stage.thrown / 4, "little was refused: is anything bad sent?"
    assert stage.answers_well(REAL)
    assert stage.answers_well(MOCKED)


@pytest.mark.parametrize("spoil", [wide, long_list])
def test_a_start_with_far_too_much_in_it_ends_short_and_poisons_nobody(spoil: Spoiler) -> None:
    """A verdict on ten thousand names was too long to be sent. The next start was refused, and ran much later."""
    stage = FuzzStage({MOCKED: nodes_of_the_mocked_m600()})
    for number, skill in enumerate(skill for skill in SKILLSET.skills for _ in range(3)):
        start = valid(Random(number), StartGoal)
        start |= {"goal_id": f"too much {number}", "client": "me", "schema": SKILLSET.schema_hash, "deadline": 1e6}
        start |= {"cause": None, "owner": None, "inputs": {}}
        answer = stage.start(MOCKED, skill.name, spoil(Random(number), start))
        assert isinstance(answer, Answered | Refused)
        assert len(answer.payload if isinstance(answer, Answered) else encode(answer.error)) < 20_000
    assert not stage.findings
    assert stage.answers_well(MOCKED)
