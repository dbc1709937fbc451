from collections.abc import Callable
from typing import Any

import pytest

from devices.microscribe.emulator.emulated_line import RATES

Connect = Callable[..., Any]
ID = b"MSCR\0"


def test_f1_nothing_is_answered(connect: Connect) -> None:
    client = connect("f1_never_answers")
    assert client.sign_on() == b""
    late = connect("f1@1+1")
    assert late.sign_on() == b"IMMC" + ID
    assert [bool(packet) for packet in late.poll(30)] == (
        [True] * 10 + [False] * 10 + [True] * 10
    )


@pytest.mark.parametrize("fault", ["f2_one_rate", "f2=14400"])
def test_f2_one_rate_only(connect: Connect, fault: str) -> None:
    wanted = 14400 if "=" in fault else 19200
    heard = {rate: connect(fault, baud=rate).sign_on() for rate in RATES}
    assert heard.pop(wanted) == b"IMMC" + ID
    assert all(ID not in answer for answer in heard.values())


@pytest.mark.parametrize("count", [1, 2, 5, 20])
def test_f3_surplus_echoes_some_of_them_after_begin(
    connect: Connect, count: int
) -> None:
    client = connect(f"f3_surplus_echoes={count}")
    before = client.ask(b"IMMC")
    after = client.ask(b"BEGIN")
    assert before == b"IMMC" * (1 + count - count // 2)
    assert after == b"IMMC" * (count // 2) + ID
    assert client.ask(b"\xc5IMMCBEGIN") == b"\xc5IMMC" + ID, "once"


def test_f4_an_end_echo_in_front_of_the_first_attention(connect: Connect) -> None:
    client = connect("f4_end_echo")
    assert client.ask(b"IMMC") == b"\xc5IMMC"
    assert client.ask(b"IMMC") == b"IMMC"


def test_f5_begin_is_never_answered(connect: Connect) -> None:
    client = connect("f5_no_begin")
    assert [client.sign_on() for _ in range(2)] == [b"IMMC", b"IMMC"]
    assert client.ask(b"\x03") == b"", "no session was opened"


@pytest.mark.parametrize(
    ("fault", "product"), [("f6", b"IBOX"), ("f6=xxxx", b"XXXX"), ("f6=EMPTY", b"")]
)
def test_f6_another_product(connect: Connect, fault: str, product: bytes) -> None:
    assert connect(fault).sign_on() == b"IMMC" + product + b"\0"


@pytest.mark.parametrize(
    ("state", "first_try"),
    [("run", b"\xc5IMMC"), ("password", b""), ("args", b"")],
)
def test_f7_a_session_left_open(connect: Connect, state: str, first_try: bytes) -> None:
    client = connect(f"f7_left_open={state}")
    assert client.ask(b"\xc5IMMC") == first_try
    if state != "run":
        # Swallowed as data; the zeros that the rules provide free the arm.
        client.ask(b"\0" if state == "password" else bytes(26))
        assert client.ask(b"\xc5IMMC").endswith(b"\xc5IMMC")
    assert client.ask(b"BEGIN") == ID


def test_f7_a_stream_left_running(connect: Connect) -> None:
    client = connect("f7=motion")
    assert client.ask(b"", 0.1).count(b"\xa3") >= 9
    assert client.ask(b"\xc5IMMC").endswith(b"\xc5IMMC")
    assert client.ask(b"BEGIN") == ID


def test_f7_at_the_rate_of_the_dead_host(connect: Connect) -> None:
    client = connect("f7", baud=9600)
    assert b"IMMC" not in client.ask(b"\xc5IMMC")
    client.port.baudrate = 115200
    client.port.read(99)
    assert client.ask(b"\xc5IMMC") == b"\xc5IMMC"
