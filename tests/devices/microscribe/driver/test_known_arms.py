from dataclasses import replace
from pathlib import Path

import pytest

from devices.microscribe.driver.known_arms import KnownArms, changes
from devices.microscribe.kinematics.arm import ArmGeometry
from devices.microscribe.kinematics.profiles import DX40937
from devices.microscribe.wire.link import ArmDescription

ARM = ArmDescription(DX40937.identity, DX40937.maxima, DX40937.geometry)


def test_what_was_kept_is_found(tmp_path: Path) -> None:
    arms = KnownArms(tmp_path / "arms")
    assert arms.find(ARM.identity.serial) is None
    arms.keep(ARM)
    known = arms.find(ARM.identity.serial)
    assert known is not None
    assert known.words == (*DX40937.dh_words, DX40937.beta_word)
    assert changes(known, ARM) == []
    assert arms.find("another") is None


@pytest.mark.parametrize("place", range(19))
def test_the_least_change_of_a_constant_is_told(tmp_path: Path, place: int) -> None:
    arms = KnownArms(tmp_path)
    arms.keep(ARM)
    words = [*DX40937.dh_words, DX40937.beta_word]
    words[place] += 1
    changed = replace(
        ARM, geometry=ArmGeometry.from_words(tuple(words[:18]), words[18])
    )
    known = arms.find(ARM.identity.serial)
    assert known is not None
    (told,) = changes(known, changed)
    assert " was " in told
    before, after = told.split(" was ")[1].split(" and is ")
    assert before.split()[0] != after.split()[0]


def test_other_encoders_are_told(tmp_path: Path) -> None:
    arms = KnownArms(tmp_path)
    arms.keep(ARM)
    known = arms.find(ARM.identity.serial)
    assert known is not None
    other = replace(DX40937.maxima, encoders=(0x3FFF, 0x3FFF, 0x1FFF, 0xFFF, 0xF9F, 0))
    (told,) = changes(known, replace(ARM, maxima=other))
    assert "encoders" in told


@pytest.mark.parametrize("serial", ["../../x", "..", "a/b", "C:\\x", " ", "x" * 39])
def test_a_serial_number_is_no_path(tmp_path: Path, serial: str) -> None:
    arms = KnownArms(tmp_path / "arms")
    arms.keep(replace(ARM, identity=replace(ARM.identity, serial=serial)))
    known = arms.find(serial)
    assert known is not None
    assert known.serial == serial
    assert [file.parent for file in tmp_path.rglob("*.json")] == [tmp_path / "arms"]


@pytest.mark.parametrize(
    "text", [b"", b"{}", b"\xff\xfe", b"[1]", b'{"serial": 3}', b"x" * 200_000]
)
def test_a_damaged_file_says_nothing(tmp_path: Path, text: bytes) -> None:
    arms = KnownArms(tmp_path)
    arms.file("S1").write_bytes(text)
    assert arms.find("S1") is None
