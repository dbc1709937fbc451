import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.emulator.emulated_line import RATES
from devices.microscribe.emulator.misreading import misread

PAIRS = [(host, arm) for host in RATES for arm in RATES if host != arm]
SIGN_ON = b"\xc5IMMC"
HOME, SET_BAUD, SET_PARAMETERS = 0x42, 0x44, 0x47


def commands(data: bytes, host: int, arm: int, keep: bool = False) -> set[int]:
    """Give the configuration commands that an arm in a session would hear."""
    return {byte & 0x7F for byte in misread(data, host, arm, keep) if byte & 0x40}


@given(st.binary(max_size=40), st.sampled_from(RATES), st.booleans())
def test_equal_rates_change_nothing(data: bytes, rate: int, keep: bool) -> None:
    assert misread(data, rate, rate, keep) == data


@given(st.binary(max_size=40), st.sampled_from(RATES), st.booleans())
def test_two_percent_of_error_change_nothing(
    data: bytes, rate: int, keep: bool
) -> None:
    """Half a bit in ten is what the frame allows."""
    assert misread(data, rate * 102 // 100, rate, keep) == data
    assert misread(data, rate * 98 // 100, rate, keep) == data


@given(st.binary(max_size=40), st.sampled_from(RATES), st.sampled_from(RATES))
def test_no_bytes_come_from_nowhere(data: bytes, host: int, arm: int) -> None:
    heard = misread(data, host, arm)
    kept = misread(data, host, arm, keep_framing_errors=True)
    assert len(heard) <= len(kept) <= max(1, len(data) * arm / host + len(data))
    left = iter(kept)
    assert all(byte in left for byte in heard), "dropping keeps the order"
    if not data:
        assert kept == b""


@pytest.mark.parametrize(("host", "arm"), PAIRS)
def test_signing_on_at_a_wrong_rate_harms_no_open_session(host: int, arm: int) -> None:
    assert HOME not in commands(SIGN_ON, host, arm, keep=True)
    assert SET_PARAMETERS not in commands(SIGN_ON, host, arm)
    if 2 * arm != 3 * host:
        assert SET_PARAMETERS not in commands(SIGN_ON, host, arm, keep=True)
    for harmless in (b"BEGIN", b"\0"):
        dangerous = {HOME, 0x43, SET_BAUD, SET_PARAMETERS, 0x50, 0x51}
        assert not commands(harmless, host, arm, keep=True) & dangerous


def test_without_the_end_in_front_a_sign_on_may_change_the_rate() -> None:
    for host, arm in PAIRS:
        heard = misread(b"IMMC", host, arm)
        assert (heard == b"\xde\xc4") == (host == 2 * arm)
        assert (SET_BAUD in commands(bytes(26), host, arm)) == (
            (host, arm) == (38400, 14400)
        )
