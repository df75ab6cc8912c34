"""Codec, packets, receiver and quality: what is shown is what was sent, or nothing."""

from __future__ import annotations

from functools import reduce
from operator import xor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.onboard.topics.video import VideoPacket
from skillwing.onboard.video import erasure
from skillwing.onboard.video.codec import AccessUnit, Decoder, Encoder, Picture, UndecodableError, jpeg
from skillwing.onboard.video.packets import LARGEST, Assembly, cut
from skillwing.onboard.video.receiver import VideoReceiver
from skillwing.onboard.video.similarity import similarity

HEIGHT, WIDTH, FPS = 90, 160, 15
SLOWEST_FPS = 6.0


@pytest.fixture(scope="module")
def film() -> list[Picture]:
    """Three seconds of a rough surface that passes by, with grain."""
    rng = np.random.default_rng(1)
    blocks = np.kron(rng.integers(0, 256, (23, 60, 3)), np.ones((4, 8, 1)))
    grain = rng.integers(-12, 13, (45, HEIGHT, WIDTH, 3))
    pictures = (blocks[:HEIGHT, 3 * k : 3 * k + WIDTH] + grain[k] for k in range(45))
    return [np.clip(picture, 0, 255).astype(np.uint8) for picture in pictures]


def test_a_stream_goes_on_while_its_rate_changes(film: list[Picture]) -> None:
    encoder, decoder = Encoder(WIDTH, HEIGHT, SLOWEST_FPS), Decoder()
    sizes: list[int] = []
    qualities: list[float] = []
    for k, picture in enumerate(film):
        unit = encoder.encode(picture, k / FPS, 1e6 if k < 20 else 1e5, FPS, keyframe=False)
        assert unit is not None
        assert unit.keyframe is (k == 0)
        sizes.append(len(unit.data))
        qualities.append(similarity(picture, decoder.decode(unit.data)))
    assert sum(sizes[-15:]) < 0.3 * sum(sizes[5:20])
    assert 8 * sum(sizes[-15:]) == pytest.approx(1e5, rel=0.4)
    assert np.mean(qualities[5:20]) > np.mean(qualities[-15:]) > 0.2


@pytest.mark.parametrize("rate", [2e5, 4e5, 9e5])
@pytest.mark.parametrize("fps", [6.0, 12.0, 15.0, 30.0])
def test_fewer_pictures_get_more_bits_each(film: list[Picture], fps: float, rate: float) -> None:
    """The bit rate stays, whatever number of pictures a second, unless they are as good as they can be with less."""
    encoder, decoder = Encoder(WIDTH, HEIGHT, SLOWEST_FPS), Decoder()
    sizes: list[int] = []
    qualities: list[float] = []
    for k, picture in enumerate(film):
        unit = encoder.encode(picture, k / fps, rate, fps, keyframe=False)
        assert unit is not None
        sizes.append(8 * len(unit.data))
        qualities.append(similarity(picture, decoder.decode(unit.data)))
    spent = np.mean(sizes[-15:]) * fps
    assert spent <= 1.2 * rate
    assert spent >= 0.8 * rate or np.mean(qualities[-15:]) > 0.998


def test_a_stream_does_not_begin_with_more_than_a_narrow_link_takes(film: list[Picture]) -> None:
    unit = Encoder(WIDTH, HEIGHT, SLOWEST_FPS).encode(film[0], 0.0, 4e4, FPS, keyframe=False)
    assert unit is not None
    assert unit.keyframe
    assert 8 * len(unit.data) < 9e4


def test_a_keyframe_on_request_needs_nothing_before_it(film: list[Picture]) -> None:
    encoder = Encoder(WIDTH, HEIGHT, SLOWEST_FPS)
    units = [encoder.encode(picture, k / FPS, 5e5, FPS, keyframe=k == 7) for k, picture in enumerate(film[:8])]
    assert [unit is not None and unit.keyframe for unit in units] == [True, *[False] * 6, True]
    assert units[7] is not None
    assert similarity(film[7], Decoder().decode(units[7].data)) > 0.5


@settings(max_examples=30, deadline=None)
@given(st.binary(max_size=400))
def test_bytes_that_are_no_picture_are_refused(data: bytes) -> None:
    with pytest.raises(UndecodableError):
        Decoder().decode(data)


def test_similarity_of_a_picture_falls_with_what_is_done_to_it(film: list[Picture]) -> None:
    picture = film[0]
    rng = np.random.default_rng(2)
    noises = [rng.normal(0.0, sigma, picture.shape) for sigma in (5.0, 20.0, 80.0)]
    worse = [similarity(picture, np.clip(picture + noise, 0, 255).astype(np.uint8)) for noise in noises]
    assert similarity(picture, picture) == pytest.approx(1.0)
    assert 1.0 > worse[0] > worse[1] > worse[2] > 0.0
    assert abs(similarity(picture, rng.integers(0, 256, picture.shape).astype(np.uint8))) < 0.05
    with pytest.raises(ValueError, match="cannot be compared"):
        similarity(picture, picture[:-1])


def test_a_jpeg_is_one(film: list[Picture]) -> None:
    assert jpeg(film[0])[:3] == b"\xff\xd8\xff"


def sent(sizes: list[int], keyframes: set[int]) -> list[tuple[VideoPacket, bytes]]:
    """The packets of pictures of these sizes, a tenth of a second apart; each is filled with its number."""
    packets: list[tuple[VideoPacket, bytes]] = []
    for frame, size in enumerate(sizes):
        unit = AccessUnit(bytes([frame % 256]) * size, frame in keyframes)
        packets += cut(unit, "goal", frame, len(packets), 0.1 * frame)
    return packets


@given(st.integers(0, 5 * LARGEST))
def test_pieces_fit_a_packet_and_make_the_whole(size: int) -> None:
    packets = sent([size], {0})
    assert all(len(data) <= LARGEST for _, data in packets)
    assembly = Assembly()
    *early, last = [assembly.add(header, data) for header, data in packets]
    assert early == [None] * (len(packets) - 1)
    assert last is not None
    assert last.unit.data == bytes(size)


@settings(max_examples=50)
@given(st.lists(st.binary(max_size=4 * LARGEST), min_size=1, max_size=4), st.integers(0, 5), st.data())
def test_of_the_pieces_of_a_picture_as_many_may_be_lost_as_there_is_parity(
    contents: list[bytes], parity: int, data: st.DataObject
) -> None:
    assembly = Assembly()
    for frame, content in enumerate(contents):
        packets = list(cut(AccessUnit(content, keyframe=False), "goal", frame, 0, 0.0, parity=parity))
        gone = data.draw(st.sets(st.integers(0, len(packets) - 1), max_size=parity))
        found = [assembly.add(header, part) for k, (header, part) in enumerate(packets) if k not in gone]
        assert [whole.unit.data for whole in found if whole is not None] == [content]


@settings(max_examples=50)
@given(st.integers(1, 40), st.integers(1, 8), st.integers(0, 20), st.data())
def test_any_pieces_that_are_as_many_as_the_parts_give_all_of_them(
    parts: int, count: int, length: int, data: st.DataObject
) -> None:
    rng = np.random.default_rng(parts * 1000 + length)
    packets = [rng.bytes(length) for _ in range(parts)]
    numbered = dict(enumerate([*packets, *erasure.parity(packets, count, length)]))
    kept = data.draw(st.sets(st.sampled_from(sorted(numbered)), min_size=parts, max_size=parts))
    assert erasure.restore({number: numbered[number] for number in kept}, parts, length) == packets
    with pytest.raises(ValueError, match="missing"):
        erasure.restore({number: numbered[number] for number in sorted(kept)[1:]}, parts, length)


@given(st.lists(st.binary(max_size=20), min_size=1, max_size=10))
def test_the_first_parity_is_the_exclusive_or(packets: list[bytes]) -> None:
    (parity,) = erasure.parity(packets, 1, 20)
    expected = reduce(xor, (int.from_bytes(packet.ljust(20, b"\0"), "big") for packet in packets))
    assert int.from_bytes(parity, "big") == expected


def test_a_picture_of_too_many_pieces_goes_with_as_much_parity_as_the_code_has() -> None:
    for size, parity in ((253 * LARGEST, 3), (256 * LARGEST, 0), (300 * LARGEST, 0)):
        header, _ = next(cut(AccessUnit(bytes(size), keyframe=True), "goal", 0, 0, 0.0, parity=8))
        assert header.parity == parity


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(1, 4), st.integers(0, 4), st.integers(0, 5000)), max_size=12))
def test_pieces_that_do_not_belong_together_make_nothing_up(story: list[tuple[int, int, int, int]]) -> None:
    """A picture consists of packets that agree on it and on its size, whatever arrives under its number."""
    assembly = Assembly()
    for part, parts, parity, size in story:
        header = VideoPacket(
            t=0.0, stream="", sequence=0, frame=1, part=part, parts=parts, size=size, keyframe=True, parity=parity
        )
        whole = assembly.add(header, b"x")
        assert whole is None or len(whole.unit.data) == size


@given(
    st.lists(st.integers(1, 3 * LARGEST), min_size=1, max_size=40),
    st.sets(st.integers(0, 39)),
    st.sets(st.integers(0, 119)),
)
def test_only_whole_pictures_that_can_be_decoded_are_shown(
    sizes: list[int], keyframes: set[int], lost: set[int]
) -> None:
    """A picture is shown if and only if it and all since the last keyframe arrived whole, whatever is lost."""
    keyframes.add(0)
    receiver = VideoReceiver()
    packets = sent(sizes, keyframes)
    shown = [
        whole.frame
        for header, data in packets
        if header.sequence not in lost and (whole := receiver.packet(header.t, header, data)) is not None
    ]
    gone = {header.frame for header, _ in packets if header.sequence in lost}
    decodable, chain = [], False
    for frame in range(len(sizes)):
        chain = frame not in gone and (chain or frame in keyframes)
        decodable += [frame] * chain
    assert shown == decodable


def test_the_report_counts_the_last_second() -> None:
    receiver = VideoReceiver()
    for header, data in sent([500] * 30, {0}):
        if header.sequence % 5 == 4 and header.t >= 2.0:
            continue
        whole = receiver.packet(header.t + 0.1, header, data)
        if whole is not None:
            receiver.shown(header.t + 0.1, whole.t, 0.9)
    status = receiver.status(3.0)
    assert status.lost == pytest.approx(1 / 9), "the very last one may still be on its way"
    assert status.bitrate == 8 * 500 * 8
    assert status.wants_keyframe
    assert (status.fps, status.quality) == (4, 0.9), "those between the keyframe and the first loss"
    assert status.latency == pytest.approx(0.1)
    later = receiver.status(10.0)
    assert (later.fps, later.quality, later.bitrate, later.latency) == (0.0, None, 0.0, None)


def test_a_stream_of_another_goal_restarts() -> None:
    receiver = VideoReceiver()
    for header, data in sent([500] * 3, {0}):
        receiver.packet(header.t, header, data)
    ((header, data),) = cut(AccessUnit(b"x", keyframe=False), "another", 7, 90, 1.0)
    assert receiver.packet(1.0, header, data) is None
    status = receiver.status(1.0)
    assert (status.stream, status.lost, status.wants_keyframe) == ("another", 0.0, True)
