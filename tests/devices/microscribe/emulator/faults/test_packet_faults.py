from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

Connect = Callable[..., Any]

seeds = settings(
    max_examples=25,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


def spoilt(connect: Connect, fault: str, seed: int, clean: bytes) -> bytes:
    """Give the second of three packets; the others must be whole."""
    client = connect(f"{fault}@packet:2", seed=seed)
    client.sign_on()
    first, second, third = client.poll(3)
    assert first == third == clean
    packet: bytes = second
    return packet


def removals(data: bytes) -> set[bytes]:
    return {data[:i] + data[i + 1 :] for i in range(len(data))}


@seeds
@given(st.integers(0, 999))
def test_f8_one_byte_is_lost(connect: Connect, clean: bytes, seed: int) -> None:
    assert spoilt(connect, "f8", seed, clean) in removals(clean)


@pytest.mark.parametrize("at", [0, 1, 13, 99])
def test_f8_at_a_place(connect: Connect, clean: bytes, at: int) -> None:
    place = min(at, 13)
    heard = spoilt(connect, f"f8_dropped_byte={at}", 0, clean)
    assert heard == clean[:place] + clean[place + 1 :]


@seeds
@given(st.integers(0, 999))
def test_f9_one_byte_comes_twice(connect: Connect, clean: bytes, seed: int) -> None:
    heard = spoilt(connect, "f9_doubled_byte", seed, clean)
    assert len(heard) == len(clean) + 1
    assert clean in removals(heard)
    assert any(heard == clean[: i + 1] + clean[i:] for i in range(len(clean)))


@seeds
@given(st.integers(0, 999))
def test_f10_one_unprotected_bit(connect: Connect, clean: bytes, seed: int) -> None:
    heard = spoilt(connect, "f10_flipped_bit", seed, clean)
    flipped = [a ^ b for a, b in zip(heard, clean, strict=True)]
    assert sorted(flipped)[:-1] == [0] * 13
    assert max(flipped) in [1 << i for i in range(7)]
    assert heard[0] == clean[0]


@seeds
@given(st.integers(0, 999), st.sampled_from(("payload", "header")))
def test_f11_bit_seven_where_it_should_not_be(
    connect: Connect, clean: bytes, seed: int, where: str
) -> None:
    heard = spoilt(connect, f"f11={where}", seed, clean)
    flipped = [a ^ b for a, b in zip(heard, clean, strict=True)]
    assert sorted(flipped) == [0] * 13 + [0x80]
    assert (flipped[0] == 0x80) == (where == "header")


@seeds
@given(st.integers(0, 999), st.sampled_from(("mixed", "low", "high")))
def test_f12_noise_between_packets(
    connect: Connect, clean: bytes, seed: int, kind: str
) -> None:
    heard = spoilt(connect, f"f12_noise={kind}", seed, clean)
    assert heard.endswith(clean)
    noise = heard[: -len(clean)]
    assert 1 <= len(noise) <= 8
    if kind != "mixed":
        assert {byte >> 7 for byte in noise} == {int(kind == "high")}


def test_garbage_has_about_the_length_and_not_the_sense(
    connect: Connect, clean: bytes
) -> None:
    client = connect("garbage@0.05+0.1")
    assert client.sign_on() == b"IMMCMSCR\0"
    first, second, third = client.poll(3)
    assert (first, third) == (clean, clean)
    assert 14 <= len(second) <= 16
    assert second[:14] != clean


def test_by_chance_each_packet_is_hit_with_the_same_probability(
    connect: Connect, clean: bytes
) -> None:
    client = connect("f8@p:0.2", seed=3)
    client.sign_on()
    hit = [packet != clean for packet in client.poll(500)]
    assert 60 < sum(hit) < 140
    assert client.arm.fired == {"f8_dropped_byte": sum(hit)}
    again = connect("f8@p:0.2", seed=3)
    again.sign_on()
    assert [packet != clean for packet in again.poll(500)] == hit
