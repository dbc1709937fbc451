import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.art import ActiveRayTracer, Quality
from renderers.art.time_slices import (
    FASTER,
    RAYS_A_SLICE,
    SLICE_S,
    next_blocks,
    next_slice,
)
from renderers.scene import Camera, Scene


@given(
    st.integers(1, 32),
    st.lists(st.floats(0, 10, allow_nan=False), min_size=1, max_size=30),
    st.integers(256, 16384),
)
def test_a_slice_gives_each_thread_a_packet_and_no_more_than_it_may(
    threads: int, spent: list[float], rays: int
) -> None:
    packets = threads
    for seconds in spent:
        before = packets
        packets = next_slice(packets, seconds, threads, rays)
        assert threads <= packets <= max(RAYS_A_SLICE // rays, threads)
        if seconds > SLICE_S:
            assert packets <= max(before, threads)
    for _ in range(9):
        packets = next_slice(packets, 2 * SLICE_S, threads, rays)
    assert packets == threads


@given(st.integers(1, 32), st.floats(1e-6, 10), st.integers(1, 5000))
def test_blocks_come_to_fill_a_slice_however_long_one_takes(
    threads: int, block_s: float, blocks: int
) -> None:
    """And never grow by more than a factor that is known."""
    for _ in range(12):
        before = blocks
        blocks = next_blocks(before, before * block_s, threads)
        assert threads <= blocks <= max(FASTER * before, threads)
    assert blocks == threads or 0.9 * SLICE_S - block_s <= blocks * block_s
    assert blocks == threads or blocks * block_s <= 1.1 * SLICE_S


def test_where_steps_are_fine_packets_are_small(
    scene: Scene, outside: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A packet cannot be interrupted; as if each took too long, each is a slice."""
    monkeypatch.setattr("renderers.art.time_slices.SLICE_S", -1.0)
    for step, packets in ((0.25, 1), (1 / 16, 4), (1 / 32, 16)):
        shares: list[float] = []
        tracer = ActiveRayTracer(scene, Quality(step, 0.0), threads=1)

        def note(share: float, shares: list[float] = shares) -> bool:
            shares.append(share)
            return True

        # parts of a strip that meet cells nobody had looked at yet go on later
        tracer.render(outside.with_size(64, 64))
        tracer.render(outside.with_size(64, 64), note)
        assert len(set(shares) - {0.0}) == packets
        assert shares == sorted(shares)
        assert shares[-1] == 1
