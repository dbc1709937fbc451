"""The picture's size on simulated machines: a frame takes time with its pixels."""

import threading

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from paravol.flight.picture_size import (
    DUE_MS,
    FIRST_PX,
    LOOKED_AT,
    LOOKED_S,
    RESTS,
    SHARP_MS,
    STEPS,
    PictureSize,
    steps_up_to,
)


class Machine:
    """Draws with a time for each frame and each thousand pixels."""

    def __init__(self, sizes: PictureSize, ms_per_kilopixel: float) -> None:
        self.sizes = sizes
        self.ms_per_kilopixel = ms_per_kilopixel
        self.now_s = 0.0
        self.changes: list[tuple[float, int]] = []

    def rest(self, frames: int) -> list[int]:
        """Rest for so many frames; return their sizes. What is shown is kept."""
        found, shown = [], self.changes[-1][1]
        for _ in range(frames):
            size = self.sizes.next()
            found.append(size)
            if size == shown:
                self.now_s += 0.01
                self.sizes.rested()
                continue
            shown = size
            self.changes.append((self.now_s, size))
            took_ms = 2.0 + self.ms_per_kilopixel * size * size / 1000.0
            self.now_s += took_ms / 1000.0
            self.sizes.took(took_ms, self.now_s)
        return found

    def fly(self, seconds: float) -> int:
        until_s, size = self.now_s + seconds, 0
        while self.now_s < until_s:
            size = self.sizes.next()
            if not self.changes or self.changes[-1][1] != size:
                self.changes.append((self.now_s, size))
            took_ms = 2.0 + self.ms_per_kilopixel * size * size / 1000.0
            self.now_s += took_ms / 1000.0
            self.sizes.took(took_ms, self.now_s)
        return size


@given(st.integers(16, 3000), st.integers(1, 5000))
def test_a_fast_machine_draws_what_is_wanted(most: int, wanted: int) -> None:
    sizes = PictureSize(most)
    assert sizes.next() == sizes.first <= min(most, FIRST_PX)
    sizes.want(wanted)
    size = Machine(sizes, 0.001).fly(5.0)
    every = steps_up_to(most)
    assert size in every
    assert size == min((step for step in every if step >= wanted), default=most)
    assert sizes.told == f"picture {size} px"


@given(st.floats(0.02, 0.4))
def test_a_slow_machine_settles_on_a_size_that_is_in_time(speed: float) -> None:
    """And tries a larger one ever more seldom."""
    sizes = PictureSize(1024)
    sizes.want(1024)
    machine = Machine(sizes, speed)
    machine.fly(120.0)

    def took(size: int) -> float:
        return 2.0 + speed * size * size / 1000.0

    settled = machine.fly(5.0)
    assert took(settled) <= DUE_MS or settled == STEPS[0]
    late = [time_s for time_s, size in machine.changes if took(size) > DUE_MS]
    assert len(late) < 12
    if settled < 1024 and late:
        assert sizes.told.endswith(f"{settled} of 1024 px: frames were late")


@given(st.floats(0.08, 0.4))
@settings(max_examples=20)
def test_a_scope_that_rests_is_shown_sharply_and_goes_on_in_time(speed: float) -> None:
    sizes = PictureSize(1024)
    sizes.want(1024)
    machine = Machine(sizes, speed)
    moving = machine.fly(30.0)
    assert moving < 1024
    due = [s for s in STEPS if s <= 1024 and 2.0 + speed * s * s / 1000 <= SHARP_MS]
    for _ in range(3):
        rested = machine.rest(100)
        assert rested[:RESTS] == [moving] * RESTS
        sharp = rested[-1]
        assert rested[RESTS:] == [sharp] * (100 - RESTS)
        # what a size takes is known from others, not quite
        assert moving < sharp <= max(due) * 1.3
        # the first that moves is as large, then they are in time again
        before = len(machine.changes)
        machine.fly(0.4)
        assert [size for _, size in machine.changes[before:]] == [moving]
    assert machine.fly(5.0) == moving


def test_one_that_rests_from_the_beginning_is_shown_sharply_too() -> None:
    sizes = PictureSize(1024)
    sizes.want(1024)
    machine = Machine(sizes, 0.03)
    machine.fly(0.2)
    assert machine.rest(100)[-1] == 1024


def test_frames_that_become_late_cost_a_step_and_come_back_in_seconds() -> None:
    sizes = PictureSize(1024)
    sizes.want(768)
    machine = Machine(sizes, 0.02)
    assert machine.fly(5.0) == 768
    machine.ms_per_kilopixel = 0.06
    begun_s = machine.now_s
    assert machine.fly(2.0) == 640
    assert "frames were late" in sizes.told
    # so much is needed to judge, and little more
    assert machine.changes[-1][0] - begun_s < 2 * LOOKED_S
    machine.ms_per_kilopixel = 0.02
    assert machine.fly(3.0 * LOOKED_S) == 768
    assert sizes.told == "picture 768 px"


@given(st.lists(st.floats(0.0, 0.4), max_size=6), st.floats(0.001, 0.05))
def test_what_was_late_before_is_forgotten(before: list[float], now: float) -> None:
    """However often: "256 of 640 px" stood there for minutes at 100 frames a second."""
    sizes = PictureSize(1024)
    sizes.want(640)
    machine = Machine(sizes, 0.02)
    for speed in before:
        machine.ms_per_kilopixel = speed
        machine.fly(7.0)
    machine.ms_per_kilopixel = now
    machine.fly(5.0 * LOOKED_S)
    assert sizes.size == 640


def test_a_single_late_frame_changes_nothing() -> None:
    sizes = PictureSize(512)
    machine = Machine(sizes, 0.02)
    machine.fly(2.0)
    for _ in range(LOOKED_AT // 2 - 1):
        sizes.took(500.0, machine.now_s)
    assert sizes.next() == 512


def test_a_smaller_window_is_followed_at_once() -> None:
    sizes = PictureSize(1024)
    sizes.want(1024)
    assert Machine(sizes, 0.001).fly(3.0) == 1024
    sizes.want(300)
    assert sizes.next() == 384
    assert sizes.told == "picture 384 px"


def test_a_size_is_drawn_when_its_tables_are_made() -> None:
    sizes = PictureSize(512)
    begun, may_end = threading.Event(), threading.Event()
    made: list[int] = []

    def prepare(size: int) -> None:
        begun.set()
        assert may_end.wait(20.0)
        made.append(size)

    sizes.prepare = prepare
    sizes.want(200)
    assert sizes.next() == 512
    assert begun.wait(20.0)
    assert sizes.next() == 512
    may_end.set()
    assert sizes._making is not None
    sizes._making.join(20.0)
    assert sizes.next() == 256
    assert made == [256]
    sizes.want(512)
    assert sizes.next() == 512


@pytest.mark.parametrize("most", [64, 512, 700, 1024])
def test_the_largest_size_is_the_one_that_was_asked_for(most: int) -> None:
    assert steps_up_to(most)[-1] == most
    assert list(steps_up_to(most)) == sorted(set(steps_up_to(most)))


@pytest.mark.parametrize(("frame_ms", "size"), [(34.0, 896), (31.0, 1024)])
def test_a_size_that_is_just_in_time_is_found(frame_ms: float, size: int) -> None:
    """As measured: a part of a frame is fixed, the rest grows with its pixels."""
    sizes = PictureSize(1024)
    sizes.want(1024)
    now_s = 0.0
    while now_s < 20.0:
        took_ms = frame_ms * (14.1 + 98.7e-6 * sizes.next() ** 2) / 117.6
        now_s += took_ms / 1e3
        sizes.took(took_ms, now_s)
    assert sizes.size == size


@settings(max_examples=10, deadline=None)
@example(8.0, 147.0, 0.0, 0)
@given(
    fixed_ms=st.floats(8.0, 30.0),
    ms_per_megapixel=st.floats(1.0, 300.0),
    noise=st.floats(0.0, 0.3),
    seed=st.integers(0, 1000),
)
def test_the_largest_size_in_time_is_kept_without_hunting(
    fixed_ms: float, ms_per_megapixel: float, noise: float, seed: int
) -> None:
    """Whatever part of a frame is fixed, and with a hiccup of 0.3 s every 5 s."""
    random = np.random.default_rng(seed)
    sizes = PictureSize(1024)
    sizes.want(1024)

    def took(size: int) -> float:
        return fixed_ms + ms_per_megapixel * size * size / 1e6

    def fly(until_s: float, now_s: float) -> tuple[dict[int, float], int]:
        spent: dict[int, float] = dict.fromkeys(STEPS, 0.0)
        changes, before = 0, sizes.size
        while now_s < until_s:
            size = sizes.next()
            changes += size != before
            before = size
            took_ms = took(size) * (1.0 + noise * (random.random() - 0.5))
            if now_s % 5.0 < 0.3:
                took_ms *= 3.0
            now_s += took_ms / 1e3
            spent[size] += took_ms / 1e3
            sizes.took(took_ms, now_s)
        return spent, changes

    fly(30.0, 0.0)
    spent, changes = fly(130.0, 30.0)
    every = steps_up_to(1024)
    due = [size for size in every if took(size) <= DUE_MS] or [every[0]]
    # one that is just in time, or just late, may be taken for the other
    doubtful = [size for size in every if 0.93 <= took(size) / DUE_MS <= 1.02]
    good = {due[-1], *doubtful, every[max(every.index(due[-1]) - len(doubtful), 0)]}
    assert sum(spent[size] for size in good) > 0.95 * sum(spent.values())
    if not doubtful:
        # a try of the next size now and then, ever more seldom
        assert changes <= 8


def test_a_hiccup_now_and_then_is_not_held_against_a_size() -> None:
    sizes = PictureSize(768)
    sizes.want(768)
    machine = Machine(sizes, 0.04)
    for _ in range(12):
        assert machine.fly(40.0) == 768
        machine.ms_per_kilopixel = 0.1
        assert machine.fly(2.0) < 768
        machine.ms_per_kilopixel = 0.04
