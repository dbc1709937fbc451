"""What `fired` counts: a fault is counted when it acts, and only then."""

from collections.abc import Callable
from typing import Any

import pytest

from devices.microscribe.emulator.faults.fault import EventFault
from devices.microscribe.emulator.motion import AnglesMotion
from devices.microscribe.kinematics.profiles import DX40937
from tests.devices.microscribe.rare_faults import EVERY_FAULT, parse_any_fault

Connect = Callable[..., Any]
STREAM = b"\xcf\x00\x09\x23" + bytes(21)
STOP = b"\x00"


def _life(client: Any) -> list[bytes]:
    """What a host does in a session, at the rate of the vendor's own software."""
    heard = [client.ask(b""), client.ask(b"\xc5IMMC"), client.ask(b"BEGIN")]
    heard += [client.ask(bytes((code,))) for code in range(0xC8, 0xCF)]
    heard += [client.ask(bytes((code,))) for code in (0xC6, 0xC0, 0xD3)]
    heard += client.poll(12)
    heard += [client.ask(STREAM, 0.3), client.ask(STOP), client.ask(b"\x23")]
    return heard


def _waving(t_s: float) -> list[float]:
    return [1.0 + 0.1 * t_s] * 6


def _all() -> list[str]:
    return [
        f"{kind.name()}={variant}" if variant else kind.name()
        for kind in EVERY_FAULT
        for variant in (kind.variants or ("",))
    ]


@pytest.mark.parametrize("fault", _all())
def test_every_fault_is_counted_when_it_acts(connect: Connect, fault: str) -> None:
    # Only a moving arm shows an encoder that is sick, and only five joints have one.
    if fault.endswith(("DEAD5", "MISSED5", "BACKWARDS5")):
        fault = fault[:-1] + "4"
    # What happens at power-on is over before anybody looks; a session left open is not.
    sudden = issubclass(parse_any_fault(fault).kind, EventFault) and "f7" not in fault
    moment = "@0.5" if sudden else ""
    client = connect(fault + moment, motion=AnglesMotion(DX40937, _waving))
    clean = connect(motion=AnglesMotion(DX40937, _waving))
    name = fault.partition("=")[0]
    assert client.arm.fired[name] == ("f7" in fault)
    try:
        heard = _life(client)
    except OSError:
        assert "cut_short" in fault
        heard = []
    assert client.arm.fired[name] > 0
    assert heard != _life(clean) or client.arm.firmware.memory_writes


@pytest.mark.parametrize(
    ("fault", "name", "baud"),
    [("f2=9600", "f2_one_rate", 9600), ("f30", "f30_slow", 9600)],
)
def test_a_rate_is_refused_as_often_as_another_one_is_tried(
    connect: Connect, fault: str, name: str, baud: int
) -> None:
    client = connect(fault, baud=115200)
    for tries in range(1, 4):
        assert b"IMMC" not in client.ask(b"\xc5IMMC")
        assert client.arm.fired[name] == tries
    right = connect("f2=9600", baud=9600)
    assert right.sign_on() == b"IMMCMSCR\0"
    assert right.arm.fired == {"f2_one_rate": 0}


def test_a_rate_is_refused_from_its_moment_on(connect: Connect) -> None:
    client = connect("f2=9600@1")
    assert client.sign_on() == b"IMMCMSCR\0"
    client.poll(15)
    client.ask(b"\xc5")
    assert client.arm.fired == {"f2_one_rate": 0}
    assert client.sign_on() == b""
    assert client.arm.fired["f2_one_rate"] > 0
