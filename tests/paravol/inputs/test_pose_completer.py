import numpy as np

from devices import Pose, ProbePath
from devices.controls.pedals import Button, ButtonEvent
from paravol.inputs.instrument_controller import InstrumentController
from paravol.inputs.pose_completer import (
    PATH_PEDAL,
    HandChannel,
    PathChannel,
    pedal_record,
)
from paravol.inputs.scope_in_hand import ScopeInHand
from paravol.inputs.second_channel import SecondChannel
from scenarios import Endoscope, Sample
from tests.devices.controls.rolls import SetRoll


def pose(time_s: float, buttons: int) -> Pose:
    return Pose(time_s, time_s + 100.0, np.eye(4), buttons)


def path() -> ProbePath:
    n = 11
    times = np.arange(n, dtype=np.float64) * 0.1
    tips = np.stack([times, 2 * times, 3 * times], axis=1)
    axis = np.tile([0.0, 1.0, 0.0], (n, 1))
    return ProbePath(
        name="line",
        t_s=times,
        tip_mm=tips,
        axis=axis,
        roll_deg=10 * times,
        instrument_tip_mm=tips + 5,
        instrument_axis=axis,
        buttons=np.zeros(n, np.int64),
    )


def test_path_time_begins_with_the_pedal() -> None:
    channel = PathChannel(path())
    assert channel.complete(pose(7.0, 0)).time_s < 0
    assert channel.complete(pose(7.5, 1)).time_s < 0  # marking a fiducial is no start
    assert channel.complete(pose(8.0, PATH_PEDAL)).time_s == 0.0
    later = channel.complete(pose(8.35, PATH_PEDAL))
    assert abs(later.time_s - 0.35) < 1e-12
    assert abs(later.roll_deg - 3.5) < 1e-9
    assert np.allclose(later.instrument_tip_mm, np.array([0.35, 0.7, 1.05]) + 5)
    # the pedal's release does not stop the clock
    assert abs(channel.complete(pose(8.5, 0)).time_s - 0.5) < 1e-12


def test_a_free_hand_counts_from_its_first_pose() -> None:
    channel = HandChannel(SetRoll(40.0))
    assert channel.complete(pose(3.0, 0)).time_s == 0.0
    sample = channel.complete(pose(3.25, 1))
    assert (sample.time_s, sample.roll_deg, sample.buttons) == (0.25, 40.0, 1)


def test_a_roll_that_nobody_knows_is_the_last_one_known() -> None:
    channel = HandChannel(SetRoll())
    assert channel.complete(pose(0.0, 0)).roll_deg == 0.0
    channel.roll = SetRoll(-15.0)
    assert channel.complete(pose(0.1, 0)).roll_deg == -15.0
    channel.roll = SetRoll()
    assert channel.complete(pose(0.2, 0)).roll_deg == -15.0


def test_pedals_are_told_with_their_sample_and_samples_pass_unchanged() -> None:
    told: list[tuple[ButtonEvent, Sample]] = []
    watch = SecondChannel(
        HandChannel(), ScopeInHand(), InstrumentController(Endoscope())
    )
    watch.on_pedal = lambda event, sample: told.append((event, sample))
    twin = HandChannel()
    # Both pedals; the right one chatters on its way down and on its way up.
    levels = [0, 1, 0, 1, 1, 1, 3, 3, 2, 3, 2, 2, 2, 2, 0, 0, 0]
    for number, buttons in enumerate(levels):
        pose = Pose(5.0 + 0.008 * number, 0.0, np.eye(4), buttons)
        sample, plain = watch.join(pose), twin.complete(pose)
        assert sample.time_s == plain.time_s
        assert sample.buttons == buttons
    texts = [pedal_record(event, sample.time_s).text for event, sample in told]
    assert texts == [
        "right pedal down",
        "left pedal down",
        "right pedal up",
        "left pedal up",
    ]
    first, sample = told[0]
    assert first == ButtonEvent(5.008, Button.RIGHT_PEDAL, True)
    assert pedal_record(first, sample.time_s).time_s == sample.time_s
