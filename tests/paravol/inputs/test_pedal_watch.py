import numpy as np

from devices import Pose
from devices.controls.pedals import Button, ButtonEvent
from paravol.inputs.pedal_watch import PedalWatch, record_of
from paravol.inputs.pose_completer import HandChannel
from scenarios import Sample


def test_pedals_are_told_with_their_sample_and_samples_pass_unchanged() -> None:
    told: list[tuple[ButtonEvent, Sample]] = []
    watch = PedalWatch(
        HandChannel(), lambda event, sample: told.append((event, sample))
    )
    twin = HandChannel()
    # Both pedals; the right one chatters on its way down and on its way up.
    levels = [0, 1, 0, 1, 1, 1, 3, 3, 2, 3, 2, 2, 2, 2, 0, 0, 0]
    for number, buttons in enumerate(levels):
        pose = Pose(5.0 + 0.008 * number, 0.0, np.eye(4), buttons)
        sample, plain = watch.complete(pose), twin.complete(pose)
        assert sample.time_s == plain.time_s
        assert sample.buttons == buttons
    texts = [record_of(event, sample.time_s).text for event, sample in told]
    assert texts == [
        "right pedal down",
        "left pedal down",
        "right pedal up",
        "left pedal up",
    ]
    first, sample = told[0]
    assert first == ButtonEvent(5.008, Button.RIGHT_PEDAL, True)
    assert record_of(first, sample.time_s).time_s == sample.time_s
