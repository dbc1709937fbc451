import pytest

from devices.microscribe.emulator.firmware import ArmFirmware
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.arm import FIELD
from devices.microscribe.kinematics.profiles import (
    HOME_COUNTS,
    PROFILE_ALIASES,
    PROFILES,
    ArmProfile,
    profile_named,
)

FIVE_JOINTS = "03 3FFF 0000000000000000 00 3FFF 3FFF 1FFF 0FFF 0FFF 0000"
# Recorded from a real unit with serial number 40937.
DX_BLOCK = (
    "00 00 3F F5 FF F9 3F E5 C0 02 C0 0C 00 00 03 C0 28 10 02 15 FE 6F 01 8F"
    " 20 6C FC 92 FF FD 24 1C 01 40 EB 66"
)
MAXIMA = {
    "6dof": "07 3FFF 0000000000000000 00 3FFF 3FFF 1FFF 0FFF 0FFF 07CF",
    "odd_maxima": "03 3A97 0000000000000000 00 3E7F 3FFF 1FFF 0FFF 0F9F 0000",
}
BLOCKS = {
    "3dx_b": "00 00 3F E1 00 1C 3F E2 BF ED C0 0D 00 00 03 BD 28 0C 02 23 FE 70 01 90"
    " 20 6C FC 94 FF FF 24 1E 01 40 EB 64",
    "nominal": "0000 4000 0000 4000 C000 C000 0000 03C0 280A 021C FE70 0190"
    " 206C FC93 0000 241D 0140 EB5B",
}
BETA = {"3dx_b": "FFE3", "nominal": "0000", "standard": None, "ibox": None}
IDS = {"ibox": b"IBOX"}


def running(profile: ArmProfile) -> ArmFirmware:
    firmware = ArmFirmware(profile, StillMotion(profile), 0.0)
    product = profile.identity.product_id.encode() + b"\0"
    assert firmware.receive(b"\xc5IMMCBEGIN", 0.0) == b"IMMC" + product
    return firmware


@pytest.mark.parametrize("name", PROFILES)
def test_every_profile_describes_itself_to_the_byte(name: str) -> None:
    firmware = running(PROFILES[name])
    maxima = bytes.fromhex(MAXIMA.get(name, FIVE_JOINTS))
    assert firmware.receive(b"\xc6", 0.0) == b"\xc6" + maxima
    block = bytes.fromhex(BLOCKS.get(name, DX_BLOCK))
    assert firmware.receive(b"\xc0", 0.0) == b"\xc0\x24" + block
    beta = BETA.get(name, "0003")
    told = b"" if beta is None else b"\xd3\x02" + bytes.fromhex(beta)
    assert firmware.receive(b"\xd3", 0.0) == told
    assert firmware.receive(b"\x49", 0.0) == b"\xc9" + IDS.get(name, b"MSCR") + b"\0"
    assert firmware.receive(b"\x4d", 0.0) == b"\xcdFormat DH0.5\0"
    assert firmware.receive(b"\x4e", 0.0) == b"\xceHCI 2.0\0"
    comment = b"Standard" if beta is None else b"Standard+Beta"
    assert firmware.receive(b"\x4c", 0.0) == b"\xcc" + comment + b"\0"
    assert firmware.receive(b"\xc1", 0.0) == b"\xc1" + bytes(12)


def test_one_profile_has_all_maxima_different() -> None:
    maxima = PROFILES["odd_maxima"].maxima
    values = (maxima.timer, *maxima.encoders[:5])
    assert len(set(values)) == len(values)
    assert any((value + 1) & value for value in maxima.encoders[:5])


def test_the_sister_product_counts_its_encoders_otherwise() -> None:
    firmware = running(PROFILES["ibox"])
    lengths = [len(firmware.receive(bytes((code,)), 0.0)) for code in (0, 1, 2, 3)]
    assert lengths == [2, 6, 10, 14]


def test_serial_numbers_are_unlike_and_short_enough_for_the_line() -> None:
    serials = [profile.identity.serial for profile in PROFILES.values()]
    assert len(set(serials)) == len(serials)
    for profile in PROFILES.values():
        about = profile.identity
        texts = (about.product_name, about.model, about.serial, about.comment)
        assert all(0 < len(text) <= 31 for text in texts)
        assert all(0 <= count < FIELD for count in profile.home_counts)


def test_the_rest_pose_is_the_recorded_one() -> None:
    assert HOME_COUNTS == (13903, 6238, 6868, 4098, 3193, 8416)
    assert PROFILES["6dof"].home_counts == (13903, 6238, 6868, 4098, 3193, 0)


def test_short_names_and_near_misses() -> None:
    for short, name in PROFILE_ALIASES.items():
        assert profile_named(short) is PROFILES[name]
    assert profile_named("dx") is PROFILES["dx40937"]
    with pytest.raises(ValueError, match="nearest is 'nominal'"):
        profile_named("nominl")
    with pytest.raises(ValueError, match=r"must be one of dx40937.*got ''$"):
        profile_named("")
