from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from devices.microscribe.kinematics.arm import ArmGeometry
from devices.microscribe.kinematics.constants_check import (
    constants_by_name,
    refuse_impossible,
    unit_of,
    unusual_constants,
)
from devices.microscribe.kinematics.profiles import DX40937, PROFILES
from devices.microscribe.wire.identity import decode_words, encode_words
from devices.microscribe.wire.link import READINGS
from devices.port import DeviceError, DeviceReason
from tests.devices.microscribe.spoilt_arm import spoilt_link

BLOCK = encode_words(DX40937.dh_words)
SWAPPED = b"".join(BLOCK[i : i + 2][::-1] for i in range(0, 36, 2))


def geometry_of(block: bytes) -> ArmGeometry:
    return ArmGeometry.from_words(decode_words(block, 18, "parameters"), 3)


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
def test_every_known_arm_is_usual(profile: Any) -> None:
    refuse_impossible(profile.geometry, "/dev/arm")
    assert unusual_constants(profile.geometry, "DX") == ""


@pytest.mark.parametrize(
    "block", [bytes(36), b"\xff" * 36, SWAPPED], ids=["zeros", "FF", "swapped"]
)
def test_what_no_arm_can_be_is_refused(block: bytes) -> None:
    with pytest.raises(DeviceError, match="no MicroScribe can have: ") as caught:
        refuse_impossible(geometry_of(block), "/dev/arm")
    assert caught.value.reason is DeviceReason.CONSTANTS
    assert "/dev/arm" in str(caught.value)


def test_every_large_change_of_one_bit_is_seen() -> None:
    """1.5 degrees and 3.3 mm; of the stylus, which pivoting finds, 26 mm."""
    unseen = []
    for bit in range(288):
        block = bytearray(BLOCK)
        block[bit // 8] ^= 0x80 >> bit % 8
        if not unusual_constants(geometry_of(bytes(block)), "DX"):
            unseen.append((bit // 16, 1 << 15 - bit % 16))
    assert max(size for word, size in unseen if word < 6) == 64
    assert max(size for word, size in unseen if 6 <= word < 17) == 64
    assert max(size for word, size in unseen if word == 17) == 512


def test_a_large_arm_of_another_model_is_let_pass() -> None:
    known = DX40937.geometry
    lengths = known.a_mm * (1, 1, 1.33, 1, 1, 1), known.d_mm * (1, 1, 1, 1.33, 1, 1)
    large = replace(known, a_mm=lengths[0], d_mm=lengths[1])
    refuse_impossible(large, "/dev/arm")
    assert unusual_constants(large, "G2LX") == ""
    assert "a 2 is 346.47 mm (258.35 to 262.35)" in unusual_constants(large, "DX")


def test_words_survive_the_geometry() -> None:
    for profile in PROFILES.values():
        words = profile.geometry.to_words()
        assert words == (*profile.dh_words, profile.beta_word)


def test_constants_have_names_and_units() -> None:
    named = constants_by_name(DX40937.geometry)
    assert len(named) == 19
    assert named["d 5"] == pytest.approx(-133.9596)
    assert named["alpha 1"] == pytest.approx(89.939575)
    assert [unit_of(name) for name in ("alpha 0", "beta", "a 0", "d 5")] == [
        *("degrees", "degrees"),
        *("mm", "mm"),
    ]
    assert np.isfinite(list(named.values())).all()


def test_a_block_is_believed_when_it_came_alike_twice() -> None:
    """The first reading has one wrong bit, which no bound would catch."""
    left = [1]

    def spoil(out: bytes) -> bytes:
        if out[:1] == b"\xc0" and left:
            left.pop()
            return out[:9] + bytes((out[9] ^ 1,)) + out[10:]
        return out

    link = spoilt_link(spoil)
    assert link.describe().geometry.to_words()[:18] == DX40937.dh_words
    assert not left


@pytest.mark.parametrize("header", [b"\xc0", b"\xc6", b"\xd3"])
def test_a_block_that_is_never_alike_is_refused(header: bytes) -> None:
    asked = [0]

    def spoil(out: bytes) -> bytes:
        if out[:1] != header:
            return out
        asked[0] += 1
        return out[:-1] + bytes((out[-1] ^ asked[0],))

    with pytest.raises(DeviceError) as caught:
        spoilt_link(spoil).describe()
    assert caught.value.reason is DeviceReason.BAD_REPLY
    assert asked[0] == READINGS


def test_impossible_constants_end_the_sign_on() -> None:
    with pytest.raises(DeviceError) as caught:
        spoilt_link(profile=replace(DX40937, dh_words=(0,) * 18)).describe()
    assert caught.value.reason is DeviceReason.CONSTANTS
