"""TRANSFORM messages: bytes to poses and back, against pyigtl and against damage."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from pyigtl import ImageMessage, MessageBase, StringMessage, TransformMessage
from pyigtl.messages import CRC64
from scipy.spatial.transform import Rotation

from devices.openigtlink import ToolTransform, TransformReader, encode
from devices.openigtlink.messages import LARGEST_BODY, RAS_FROM_LPS, greeting

EPOCH_S = 1_792_134_567.25
MESSAGE_BYTES = 106
HEADER_BYTES = 58

unit = st.floats(-1.0, 1.0)
coordinate = st.floats(-500.0, 500.0)
stamps = st.floats(0.001, 2.0**32 - 1.0)
names = st.text(
    st.characters(min_codepoint=0x21, max_codepoint=0x7E), min_size=1, max_size=20
)


def rigid(turn: tuple[float, ...], at: tuple[float, ...]) -> NDArray[np.float64]:
    matrix = np.eye(4)
    quaternion = np.array(turn) if np.linalg.norm(turn) > 1e-3 else np.eye(4)[3]
    matrix[:3, :3] = Rotation.from_quat(quaternion).as_matrix()
    matrix[:3, 3] = at
    return matrix


matrices = st.builds(
    rigid, st.tuples(unit, unit, unit, unit), st.tuples(*([coordinate] * 3))
)
transforms = st.builds(ToolTransform, names, stamps, matrices)


def numbered(count: int, name: str = "ScopeTipToPatient") -> list[ToolTransform]:
    rng = np.random.default_rng(1)
    return [
        ToolTransform(
            name,
            EPOCH_S + 0.01 * i,
            rigid(tuple(rng.normal(size=4)), tuple(rng.normal(size=3) * 50)),
        )
        for i in range(count)
    ]


def as_sent(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    return matrix.astype(np.float32).astype(np.float64)


@given(transforms)
def test_a_round_trip_is_exact_to_float32(sent: ToolTransform) -> None:
    (got,) = TransformReader().feed(encode(sent))
    assert got.name == sent.name
    assert got.time_s == pytest.approx(sent.time_s, rel=0, abs=1e-6)
    assert np.array_equal(got.world_from_tool, as_sent(sent.world_from_tool))


@given(transforms)
def test_pyigtl_reads_the_same_matrix_in_ras_and_the_same_time(
    sent: ToolTransform,
) -> None:
    data = encode(sent)
    header = MessageBase.parse_header(data[:HEADER_BYTES])
    message = TransformMessage()
    message.unpack(header, data[HEADER_BYTES:])
    assert message.device_name == sent.name
    assert message.timestamp == pytest.approx(sent.time_s, rel=0, abs=1e-6)
    expected = as_sent(sent.world_from_tool)
    expected[:2] *= -1.0  # left is minus right, posterior minus anterior
    assert np.array_equal(message.matrix, expected)


def test_a_tool_on_the_patients_left_is_on_the_left_of_a_ras_peer() -> None:
    matrix = np.eye(4)
    matrix[:3, 3] = 10.0, -20.0, 30.0  # left, anterior, superior
    sent = TransformMessage()
    data = encode(ToolTransform("tool", EPOCH_S, matrix))
    sent.unpack(MessageBase.parse_header(data[:HEADER_BYTES]), data[HEADER_BYTES:])
    assert sent.matrix[:3, 3].tolist() == [-10.0, 20.0, 30.0]
    # The tool's own axes are not renamed: only the world's are.
    assert sent.matrix[:3, 2].tolist() == [0.0, 0.0, 1.0]
    assert np.array_equal(RAS_FROM_LPS @ RAS_FROM_LPS, np.eye(4))


def test_the_bytes_are_those_of_the_protocol() -> None:
    data = encode(ToolTransform("tool", 3.5, np.eye(4)))
    assert len(data) == MESSAGE_BYTES
    version, kind, name, seconds, fraction, length, crc = struct.unpack(
        ">H12s20sIIQQ", data[:HEADER_BYTES]
    )
    assert (version, kind, name) == (1, b"TRANSFORM\0\0\0", b"tool".ljust(20, b"\0"))
    assert (seconds, fraction, length) == (3, 1 << 31, 48)
    assert crc == CRC64(data[HEADER_BYTES:])
    columns = [-1.0, 0, 0, 0, -1, 0, 0, 0, 1, 0, 0, 0]
    assert list(struct.unpack(">12f", data[HEADER_BYTES:])) == columns


@given(st.lists(st.integers(1, 300), max_size=60))
@settings(deadline=None)
def test_messages_survive_every_way_of_cutting_the_bytes(cuts: list[int]) -> None:
    sent = numbered(20)
    data = b"".join(map(encode, sent))
    reader, got = TransformReader(), []
    for cut in cuts:
        got += reader.feed(data[:cut])
        data = data[cut:]
    got += reader.feed(data)
    assert [t.time_s for t in got] == pytest.approx([t.time_s for t in sent], abs=1e-6)
    assert (reader.garbage, reader.damaged, reader.refused, reader.foreign) == (0,) * 4


damages = st.one_of(
    st.none(),
    st.tuples(st.just("flip"), st.integers(HEADER_BYTES, MESSAGE_BYTES - 1)),
    st.tuples(st.just("cut"), st.integers(1, MESSAGE_BYTES - 1)),
    st.tuples(st.just("noise"), st.binary(min_size=1, max_size=200)),
)


@given(st.lists(damages, max_size=12), st.integers(1, 500))
@settings(deadline=None)
def test_damage_costs_the_damaged_messages_and_no_other(
    plan: list[tuple[str, int | bytes] | None], piece: int
) -> None:
    # Enough whole messages behind them to fill the largest body that is waited for.
    sent = numbered(len(plan) + 1 + LARGEST_BODY // MESSAGE_BYTES + 2)
    data, whole = b"", []
    for number, transform in enumerate(sent):
        message = encode(transform)
        match plan[number] if number < len(plan) else None:
            case ("flip", int(at)):
                message = message[:at] + bytes([message[at] ^ 0x41]) + message[at + 1 :]
            case ("cut", int(at)):
                message = message[:at]
            case ("noise", bytes(noise)):
                message = noise + message
                whole.append(transform.time_s)
            case _:
                whole.append(transform.time_s)
        data += message
    reader, got = TransformReader(), []
    for start in range(0, len(data), piece):
        got += reader.feed(data[start : start + piece])
    assert [t.time_s for t in got] == pytest.approx(whole, rel=0, abs=1e-6)
    if any(plan):
        assert reader.garbage > 0


@pytest.mark.parametrize("before", range(58, 120))
def test_what_looks_like_a_message_within_garbage_is_not_passed_over(
    before: int,
) -> None:
    """Byte by byte, reading once began again anywhere, not at the next TRANSFORM."""
    other = struct.pack(">H12s20sIIQQ", 1, b"IMAGE", b"", 0, 0, 1000, 0)
    data = b"\xff" * before + other + encode(ToolTransform("scope", 1.0, np.eye(4)))
    reader = TransformReader()
    found = [one for k in range(len(data)) for one in reader.feed(data[k : k + 1])]
    assert [one.name for one in found] == ["scope"]
    assert reader.garbage == before + len(other)
    assert reader.foreign == 0


def test_other_messages_are_passed_over_whatever_their_size() -> None:
    first, second = numbered(2)
    image = ImageMessage(np.zeros((40, 300, 200), np.uint8), device_name="CT")
    text = StringMessage("hello", device_name="Text")
    reader = TransformReader()
    data = encode(first) + image.pack() + text.pack() + encode(second)
    got = [t for at in range(0, len(data), 4000) for t in reader.feed(data[at:][:4000])]
    assert [t.time_s for t in got] == pytest.approx([first.time_s, second.time_s])
    assert (reader.foreign, reader.garbage) == (2, 0)


def test_the_third_version_with_its_remarks_is_read() -> None:
    (sent,) = numbered(1)
    message = TransformMessage(
        RAS_FROM_LPS @ sent.world_from_tool, timestamp=sent.time_s, device_name="Tool"
    )
    message.header_version = 2
    message.metadata = {"status": "OK", "unit": "mm"}
    (got,) = TransformReader().feed(message.pack())
    assert np.array_equal(got.world_from_tool, as_sent(sent.world_from_tool))
    assert got.name == "Tool"


def framed(body: bytes, version: int = 1, name: bytes = b"tool") -> bytes:
    header = struct.pack(
        ">H12s20sIIQQ", version, b"TRANSFORM", name, 9, 0, len(body), CRC64(body)
    )
    return header + body


def floats(*values: float) -> bytes:
    return struct.pack(">12f", *values)


@pytest.mark.parametrize(
    "message",
    [
        framed(floats(*([float("nan")] * 12))),
        framed(floats(2, 0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0)),
        framed(floats(-1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0)),
        framed(b"\0" * 44),
        framed(b"\0" * 48),
        framed(b"", version=2),
        framed(b"\xff" * 60, version=2),
        framed(floats(1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0), name=b""),
        framed(floats(1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0), name=b"\xff\xfe"),
    ],
)
def test_whole_messages_that_hold_no_pose_are_refused_and_reading_goes_on(
    message: bytes,
) -> None:
    (sent,) = numbered(1)
    reader = TransformReader()
    assert len(reader.feed(message + encode(sent))) == 1
    assert (reader.refused, reader.garbage) == (1, 0)


def test_a_rotation_of_a_careless_peer_is_straightened() -> None:
    (sent,) = numbered(1)
    rough = RAS_FROM_LPS @ sent.world_from_tool
    rough[:3, :3] += 1e-5 * np.random.default_rng(2).normal(size=(3, 3))
    (got,) = TransformReader().feed(TransformMessage(rough, device_name="t").pack())
    rotation = got.world_from_tool[:3, :3]
    assert np.abs(rotation @ rotation.T - np.eye(3)).max() < 1e-14
    assert np.abs(rotation - sent.world_from_tool[:3, :3]).max() < 5e-5


def test_a_peer_without_a_clock_says_no_time() -> None:
    (got,) = TransformReader().feed(encode(ToolTransform("t", None, np.eye(4))))
    assert got.time_s is None


def test_names_that_do_not_fit_are_refused() -> None:
    for name in ("", "x" * 21, "é" * 11):
        with pytest.raises(ValueError, match="20 bytes"):
            encode(ToolTransform(name, None, np.eye(4)))


def test_a_new_line_does_not_go_on_with_half_a_message() -> None:
    first, second = numbered(2)
    reader = TransformReader()
    reader.feed(encode(first)[:70])
    reader.restart()
    assert len(reader.feed(encode(second))) == 1
    assert reader.garbage == 0


def composed(
    kind: str, content: bytes, *, version: int = 1, name: str = "Stylus", **remarks: str
) -> bytes:
    """Compose a message as the protocol says, with remarks and its own CRC."""
    body = content
    if version > 1:
        index = struct.pack(">H", len(remarks)) + b"".join(
            struct.pack(">HHI", len(key), 3, len(value.encode()))
            for key, value in remarks.items()
        )
        values = b"".join(k.encode() + v.encode() for k, v in remarks.items())
        head = struct.pack(">HHII", 12, len(index), len(values), 7)
        body = head + content + index + values
    return struct.pack(
        ">H12s20sIIQQ", version, kind.encode(), name.encode(), 5, 0, len(body),
        CRC64(body),
    ) + body  # fmt: skip


def columns(matrix: NDArray[np.float64]) -> bytes:
    return struct.pack(">12f", *(RAS_FROM_LPS @ matrix)[:3].T.ravel())


@pytest.mark.parametrize(
    ("status", "seen"),
    [
        ("OK", True),
        ("SWITCH2_IS_ON", True),
        ("INVALID", False),
        ("OUT_OF_VIEW", False),
        ("TOOL_OUT_OF_VOLUME", False),
        ("MISSING", False),
        ("something new", False),
    ],
)
@pytest.mark.parametrize("version", [2, 3])
def test_a_tool_that_plus_does_not_see_has_no_pose(
    status: str, seen: bool, version: int
) -> None:
    """PLUS sends identity or the last pose then, and says so in its remarks."""
    sent = numbered(1)[0].world_from_tool
    data = composed("TRANSFORM", columns(sent), version=version, TransformStatus=status)
    (got,) = TransformReader().feed(data)
    assert (got.status == "") == seen
    if seen:
        assert got.world_from_tool == pytest.approx(sent, abs=1e-4)


def test_remarks_without_a_status_change_nothing() -> None:
    sent = numbered(1)[0].world_from_tool
    long = "StylusTipToReferenceOfThePatient"
    for remarks in ({}, {"other": "x" * 300}, {"TransformValid": "1"}):
        data = composed("TRANSFORM", columns(sent), version=2, **remarks)
        (got,) = TransformReader().feed(data)
        assert (got.name, got.status) == ("Stylus", "")
    data = composed("TRANSFORM", columns(sent), version=2, IGTL_DEVICE_NAME=long)
    assert TransformReader().feed(data)[0].name == long
    data = composed("TRANSFORM", columns(sent), version=2, TransformValid="0")
    assert TransformReader().feed(data)[0].status


@pytest.mark.parametrize("place", [0, 1, 2])
@pytest.mark.parametrize("number", [-3.697e28, 1e9, -1e6])
def test_numbers_for_a_missing_value_are_no_place(place: int, number: float) -> None:
    matrix = np.eye(4)
    matrix[place, 3] = number
    (got,) = TransformReader().feed(composed("TRANSFORM", columns(matrix)))
    assert got.status == "the tool is missing"


def test_a_message_without_a_checksum_is_read() -> None:
    """Some peers compute none and send 0; another one has to be right."""
    data = bytearray(encode(numbered(1)[0]))
    data[50:58] = bytes(8)
    assert len(TransformReader().feed(bytes(data))) == 1
    data[57] = 1
    assert TransformReader().feed(bytes(data)) == []


@given(transforms)
def test_other_messages_of_poses_place_the_same_tool(sent: ToolTransform) -> None:
    ras = RAS_FROM_LPS @ sent.world_from_tool
    turn = Rotation.from_matrix(ras[:3, :3]).as_quat(canonical=True)
    place = struct.pack(">3f", *ras[:3, 3])
    full = place + struct.pack(">4f", *turn)
    short = place + struct.pack(">3f", *turn[:3])
    tools = b"".join(
        name.encode().ljust(20, b"\0") + b"\x01\0" for name in ("Other", sent.name)
    )
    other, own = tools[:22], tools[22:]
    bodies = {
        "POSITION": [full, short],
        "TDATA": [other + columns(np.eye(4)) + own + columns(sent.world_from_tool)],
        "QTDATA": [other + full + own + full],
    }
    for kind, contents in bodies.items():
        for content in contents:
            for version in (1, 2):
                data = composed(kind, content, version=version, name=sent.name)
                got = TransformReader().feed(data)
                assert [t.name for t in got] == ["Other", sent.name][-len(got) :]
                # w of a quaternion that is nearly half a turn is lost to rounding
                assert got[-1].world_from_tool == pytest.approx(
                    sent.world_from_tool, abs=2e-3
                )


def test_what_is_not_used_is_told_with_its_reason() -> None:
    scaled = numbered(1)[0].world_from_tool.copy()
    scaled[:3, :3] *= 1.01
    reader = TransformReader()
    reader.feed(composed("TRANSFORM", columns(scaled)))
    reader.feed(composed("POSITION", struct.pack(">3f", 1, 2, 3)))
    reader.feed(composed("IMAGE", b"x" * 10) * 3)
    damaged = bytearray(encode(numbered(1)[0]))
    damaged[-1] ^= 1
    reader.feed(bytes(damaged))
    told = "; ".join(f"{n} {why}" for why, n in reader.reasons.items())
    for words in ("length is 1.01", "without an orientation", "3 of type IMAGE"):
        assert words in told
    assert "1 with a wrong checksum" in told


def test_the_greeting_is_a_message_of_the_second_version() -> None:
    header = MessageBase.parse_header(greeting()[:HEADER_BYTES])
    assert header["header_version"] == 2
    assert len(greeting()) == HEADER_BYTES + header["body_size"]
    reader = TransformReader()
    assert reader.feed(greeting() + encode(numbered(1)[0]))[0].status == ""
    assert (reader.foreign, reader.garbage) == (1, 0)
