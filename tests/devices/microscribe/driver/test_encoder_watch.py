import pytest

from devices.microscribe.driver.encoder_watch import EncoderWatch

PRESENT = (True, True, True, False)


def _watch(seconds: float, *, frozen: int | None, hz: float = 100.0) -> EncoderWatch:
    watch = EncoderWatch(PRESENT)
    for i in range(int(seconds * hz)):
        counts = [5 * i, 7 * i, 9 * i, 8416]
        if frozen is not None:
            counts[frozen] = 1234
        watch.observe(counts, i / hz)
    return watch


@pytest.mark.parametrize("hz", [20.0, 100.0, 823.0])
@pytest.mark.parametrize("joint", [0, 1, 2])
def test_a_frozen_encoder_is_told_after_five_seconds(joint: int, hz: float) -> None:
    assert _watch(4.8, frozen=joint, hz=hz).frozen == ()
    assert _watch(5.5, frozen=joint, hz=hz).frozen == (joint,)


def test_an_encoder_that_is_not_there_is_not_frozen() -> None:
    assert _watch(20.0, frozen=None).frozen == ()


def test_an_arm_at_rest_has_no_frozen_encoders() -> None:
    watch = EncoderWatch(PRESENT)
    for i in range(2000):
        watch.observe((10 + i % 2, 20, 30, 0), i / 100.0)
    assert watch.frozen == ()


def test_an_encoder_that_stirs_again_is_well() -> None:
    watch = _watch(6.0, frozen=1)
    watch.observe((0, 1235, 0, 0), 6.2)
    assert watch.frozen == ()


def test_a_pause_of_the_packets_proves_nothing() -> None:
    watch = EncoderWatch(PRESENT)
    watch.observe((0, 0, 0, 0), 0.0)
    watch.observe((500, 500, 0, 0), 60.0)
    assert watch.frozen == ()
