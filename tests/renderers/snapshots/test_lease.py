"""When a silent worker counts as dead."""

from hypothesis import given
from hypothesis import strategies as st

from renderers.snapshots.lease import LeaseWatch

LEASE_S = 15.0


def test_a_heart_that_beats_is_never_stale() -> None:
    now = 0.0
    watch = LeaseWatch(lambda: now)
    for beat in range(5):
        assert not watch.is_stale("job", (1, beat), LEASE_S)
        now += LEASE_S
    assert watch.was_alive("job")


@given(
    st.lists(
        st.tuples(st.floats(0.1, 40), st.integers(1, 2), st.integers(0, 2)), min_size=1
    )
)
def test_only_what_was_watched_for_a_whole_lease_is_stale(
    looks: list[tuple[float, int, int]],
) -> None:
    """The last looks in a row that saw the same heartbeat decide, and nothing else."""
    now = 0.0
    watch = LeaseWatch(lambda: now)
    since, before = 0.0, None
    for wait, *heartbeat in looks:
        now += wait
        beat = heartbeat[0], heartbeat[1]
        if beat != before:
            since, before = now, beat
        assert watch.is_stale("job", beat, LEASE_S) == (now - since > LEASE_S)


def test_jobs_are_judged_apart_and_forgotten_when_they_end() -> None:
    now = 0.0
    watch = LeaseWatch(lambda: now)
    assert not watch.is_stale("a", (1, 0), LEASE_S)
    now = 10.0
    assert not watch.is_stale("b", (1, 0), LEASE_S)
    now = 16.0
    assert watch.is_stale("a", (1, 0), LEASE_S)
    assert not watch.is_stale("b", (1, 0), LEASE_S)
    assert not watch.was_alive("a")
    watch.keep_only({"b"})
    assert not watch.is_stale("a", (1, 0), LEASE_S)
    watch.forget("b")
    now = 100.0
    assert not watch.is_stale("b", (1, 0), LEASE_S)
