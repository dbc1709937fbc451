import random

import pytest

from devices.microscribe.emulator_faults import FAULTS, parse_fault


@pytest.mark.parametrize("name", sorted(FAULTS))
def test_faults_are_known_by_name(name: str) -> None:
    fault = parse_fault(f"{name}@2.5")
    assert type(fault) is FAULTS[name]
    assert [fault.active(t) for t in (2.4, 2.5, 1e9)] == [False, True, True]
    short = parse_fault(f"{name}@2.5+0.5")
    assert [short.active(t) for t in (2.5, 3.0)] == [True, False]


@pytest.mark.parametrize("text", ["garbage", "garbage@", "nonsense@3", "mute@1+", "@3"])
def test_unknown_faults_are_refused_with_the_list(text: str) -> None:
    with pytest.raises(ValueError, match="garbage, mute, unplug"):
        parse_fault(text)


def test_what_each_does_to_the_bytes() -> None:
    noise = random.Random(1)
    garbage = parse_fault("garbage@0").spoil(b"\xa3" + bytes(15), noise)
    assert 16 <= len(garbage) <= 18
    assert garbage[:16] != b"\xa3" + bytes(15)
    assert parse_fault("mute@0").spoil(b"abc", noise) == b""
    assert parse_fault("unplug@0").spoil(b"abc", noise) == b"abc"
    assert parse_fault("unplug@0").unplugs
