"""The roll of a hand-held scope comes from its frame."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices import Pose
from devices.controls.fulcrum import Demand, Fulcrum, FulcrumControl
from paravol.inputs.flight_input import framed_hand
from scenarios import Endoscope

unit = st.floats(-1.0, 1.0)


@given(unit, unit, unit)
def test_the_light_post_is_where_the_frame_says(
    yaw: float, pitch: float, roll: float
) -> None:
    fulcrum = Fulcrum(np.zeros(3), np.array((0.0, 0.86, 0.5)))
    control = FulcrumControl(fulcrum)
    control.advance(1.0, Demand(0.5, yaw, pitch, roll))
    pose = Pose(0.0, 0.0, control.frame(), 0)
    sample = framed_hand().complete(pose)
    turned = math.remainder(sample.roll_deg - control.roll_deg, 360.0)
    assert turned == pytest.approx(0.0, abs=1e-9)
    # A scope that looks 30 degrees to its post sees there what the frame's y says.
    camera = Endoscope(angle_deg=30.0).camera(
        pose.device_from_tip, sample.roll_deg, (8, 8)
    )
    y, back = pose.device_from_tip[:3, 1], pose.device_from_tip[:3, 2]
    looks = camera.frame[3]
    expected = math.cos(math.radians(30)) * -back + math.sin(math.radians(30)) * y
    assert looks == pytest.approx(expected, abs=1e-9)
