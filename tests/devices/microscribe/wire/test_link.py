import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import pytest

from devices.microscribe.kinematics.profiles import DX40937, HOME_COUNTS, ArmProfile
from devices.microscribe.wire.line import LinkTiming
from devices.microscribe.wire.link import ArmLink
from devices.microscribe.wire.protocol import State
from devices.microscribe.wire.sign_on import RATES
from devices.port import DeviceError, DeviceReason
from tests.devices.memory_port import MemoryPort, memory_port_pair

ONE_RATE = (115200,)


def _reason(link: ArmLink, rates: tuple[int, ...] = ONE_RATE) -> DeviceReason:
    def open_session() -> None:
        link.sign_on(rates)
        link.describe()

    with pytest.raises(DeviceError) as caught:
        open_session()
    text = str(caught.value)
    assert text.endswith(".")
    assert "\n" not in text
    return caught.value.reason


@pytest.mark.parametrize(
    ("code", "words"),
    [(0xC8, "product name"), (0xCA, "model"), (0xCB, "serial"), (0xCE, "firmware")],
)
def test_an_arm_that_leaves_out_who_it_is_is_told_what_it_left_out(
    serve_arm: Callable[..., Any], hasty: LinkTiming, code: int, words: str
) -> None:
    arm = serve_arm()
    arm.spoil = lambda out: bytes((code, 0)) if out[:1] == bytes((code,)) else out
    link = ArmLink(arm.port, hasty)
    link.sign_on(ONE_RATE)
    with pytest.raises(DeviceError, match=rf"leaves its {words}.* empty;") as caught:
        link.describe()
    assert "ArmIdentity" not in str(caught.value)


def test_sign_on_describe_sample_end(
    serve_arm: Callable[..., Any], hasty: LinkTiming
) -> None:
    arm = serve_arm()
    link = ArmLink(arm.port, hasty)
    link.sign_on(ONE_RATE)
    described = link.describe()
    assert described.identity == DX40937.identity
    assert described.maxima == DX40937.maxima
    assert described.geometry.d_mm.tolist() == DX40937.geometry.d_mm.tolist()
    assert described.geometry.beta == DX40937.geometry.beta
    arm.motion.buttons = 2
    sample = link.sample()
    assert sample is not None
    assert sample[0].counts == HOME_COUNTS
    assert sample[0].buttons == 2
    assert link.ping()
    link.end()
    assert link.session.state is State.OFF
    assert bytes(arm.heard).endswith(b"\xc5")
    assert arm.motion.homed == 0
    assert link.session.stray == 0


@pytest.mark.parametrize(
    "left_open",
    [
        b"IMMC",
        b"IMMCBEGIN",
        b"IMMCBEGIN\xcf\x00\x09\x23" + bytes(21),
        b"IMMCBEGIN\xcf\x00\x09\x23",
        b"IMMCBEGIN\xc3SER",
    ],
    ids=["half signed on", "idle", "streaming", "half a stream command", "password"],
)
def test_a_session_left_open_by_a_dead_host_is_taken_over(
    serve_arm: Callable[..., Any], hasty: LinkTiming, left_open: bytes
) -> None:
    arm = serve_arm()
    arm.port.write(left_open)
    arm.port.read(1000, 0.1)
    link = ArmLink(arm.port, hasty)
    link.sign_on(ONE_RATE)
    assert link.serial_number() == DX40937.identity.serial
    assert arm.motion.homed == 0


def test_surplus_and_late_echoes_do_not_disturb(
    serve_arm: Callable[..., Any], hasty: LinkTiming
) -> None:
    arm = serve_arm()
    arm.spoil = lambda out: out * 5 if out == b"IMMC" else out
    link = ArmLink(arm.port, hasty)
    link.sign_on(ONE_RATE)
    assert link.serial_number() == "EMU00001"
    link.end()
    arm.spoil = lambda out: b"IMMCBEGIN" + out if out == b"MSCR\0" else out
    link.sign_on(ONE_RATE)
    assert link.serial_number() == "EMU00001"


class _OneRatePort(MemoryPort):
    """A line whose far end hears one rate only."""

    heard_at = 19200

    def write(self, data: bytes) -> None:
        if self.rate == self.heard_at:
            super().write(data)


def test_the_scan_finds_the_rate(
    serve_arm: Callable[..., Any], hasty: LinkTiming
) -> None:
    arm = serve_arm()
    port = _OneRatePort("scanned", arm.port._in, arm.port._out)
    link = ArmLink(port, hasty)
    link.sign_on(RATES)
    assert link.baud == 19200
    assert link.serial_number() == "EMU00001"


def test_silence_is_no_device(hasty: LinkTiming) -> None:
    near, _far = memory_port_pair()
    assert _reason(ArmLink(near, hasty)) is DeviceReason.NO_DEVICE


def test_senseless_bytes_are_garbage(
    serve_arm: Callable[..., Any], hasty: LinkTiming
) -> None:
    arm = serve_arm()
    arm.spoil = lambda out: bytes(b ^ 0x55 for b in out)
    assert _reason(ArmLink(arm.port, hasty)) is DeviceReason.GARBAGE


def test_a_far_end_that_never_begins(
    serve_arm: Callable[..., Any], hasty: LinkTiming
) -> None:
    arm = serve_arm()
    arm.spoil = lambda out: b"" if out == b"MSCR\0" else out
    assert _reason(ArmLink(arm.port, hasty)) is DeviceReason.CANT_BEGIN


@pytest.mark.parametrize("product", ["IBOX", "XXXX", ""])
def test_another_product_is_refused_and_released(
    serve_arm: Callable[..., Any], hasty: LinkTiming, product: str
) -> None:
    identity = replace(DX40937.identity, product_id=product)
    arm = serve_arm(replace(DX40937, identity=identity))
    assert _reason(ArmLink(arm.port, hasty)) is DeviceReason.WRONG_DEVICE
    arm.port.read(1, 0.05)
    assert bytes(arm.heard).endswith(b"\xc5")


def test_a_looped_cable_is_recognised(hasty: LinkTiming) -> None:
    near, far = memory_port_pair("looped")

    def echo() -> None:
        try:
            while True:
                far.write(far.read(1, 0.02))
        except DeviceError:
            return

    thread = threading.Thread(target=echo)
    thread.start()
    link = ArmLink(near, replace(hasty, begin=3.0))
    assert _reason(link) is DeviceReason.LOOPBACK
    far.close()
    thread.join()


def _with(**changes: str) -> ArmProfile:
    return replace(DX40937, identity=replace(DX40937.identity, **changes))


def test_an_unknown_format_is_refused(
    serve_arm: Callable[..., Any], hasty: LinkTiming
) -> None:
    arm = serve_arm(_with(parameter_format="Format 1.1"))
    assert _reason(ArmLink(arm.port, hasty)) is DeviceReason.UNSUPPORTED_FORMAT


def test_beta_is_asked_for_only_where_announced(
    serve_arm: Callable[..., Any], hasty: LinkTiming
) -> None:
    arm = serve_arm(_with(comment="Standard"))
    link = ArmLink(arm.port, hasty)
    link.sign_on(ONE_RATE)
    assert link.describe().geometry.beta == 0.0
    assert b"\xd3" not in bytes(arm.heard)


def test_a_missing_beta_is_an_error_and_not_zero(
    serve_arm: Callable[..., Any], hasty: LinkTiming
) -> None:
    arm = serve_arm()
    arm.spoil = lambda out: b"" if out[:1] == b"\xd3" else out
    assert _reason(ArmLink(arm.port, hasty)) is DeviceReason.BAD_REPLY


@pytest.mark.parametrize("spoilt", [b"", b"\xcaDX", b"\xca" + b"x" * 60, b"\xca\xff\0"])
def test_broken_strings_are_bounded(
    serve_arm: Callable[..., Any], hasty: LinkTiming, spoilt: bytes
) -> None:
    arm = serve_arm()
    arm.spoil = lambda out: spoilt if out[:1] == b"\xca" else out
    assert _reason(ArmLink(arm.port, hasty)) is DeviceReason.BAD_REPLY


def _spoil(kind: str, at: int, out: bytes) -> bytes:
    if not out:
        return out
    if kind == "doubled":
        return out[: at + 1] + out[at:]
    if kind == "dropped":
        return out[:at] + out[at + 1 :]
    if kind == "bit 7":
        return out[:at] + bytes((out[at] | 0x80,)) + out[at + 1 :]
    return bytes((out[0] & 0x7F,)) + out[1:]


@pytest.mark.parametrize(
    ("kind", "places"),
    # All but the first wait for a byte that does not come.
    [
        ("doubled", range(1, 16)),
        ("dropped", (0, 1, 15)),
        ("bit 7", (1, 8, 15)),
        ("no header", (0,)),
    ],
)
def test_no_sample_from_a_spoilt_packet(
    serve_arm: Callable[..., Any],
    hasty: LinkTiming,
    kind: str,
    places: Sequence[int],
) -> None:
    arm = serve_arm()
    link = ArmLink(arm.port, hasty)
    link.sign_on(ONE_RATE)
    for at in places:
        arm.spoil = partial(_spoil, kind, at)
        assert link.sample() is None
        arm.spoil = bytes
        link.port.read(64, 0.01)
        assert link.sample() is not None
