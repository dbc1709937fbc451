"""Two eyes see near things apart by what their distance says."""

import numpy as np
import pytest

from paravol.snapshots.stereo import both_eyes, exposed
from paravol.snapshots.view_file import (
    ClassicLook,
    PhantomHead,
    ScopeLook,
    ViewCamera,
    ViewFile,
)

VIEW = ViewFile(
    "paravol.view/1",
    PhantomHead(),
    ViewCamera(
        (3.0, 0.0, 1.0), 0.6, target_mm=(9.0, 30.0, 4.0), projection="perspective"
    ),
    size_px=(400, 300),
    look=ClassicLook(),
)


@pytest.mark.parametrize("away", [5.0, 20.0, 80.0])
@pytest.mark.parametrize("apart", [0.5, 3.0])
def test_disparity_is_focal_length_times_base_over_depth(
    away: float, apart: float
) -> None:
    middle = VIEW.to_camera()
    point = middle.eye_mm + away * middle.frame[3] + 0.7 * middle.frame[2]
    left, right = (view.to_camera() for view in both_eyes(VIEW, apart))
    a, b = (eye.project(point)[0] for eye in (left, right))
    focal_px = 150 / np.tan(0.6)
    assert a[0] - b[0] == pytest.approx(focal_px * apart / away, rel=1e-9)
    assert a[1] == pytest.approx(b[1], abs=1e-9)
    np.testing.assert_allclose((left.eye_mm + right.eye_mm) / 2, middle.eye_mm)


def test_exposure_is_fixed_where_there_is_a_camera() -> None:
    assert exposed(VIEW, 3.0) is VIEW
    assert exposed(VIEW, None) is VIEW
    scope = ViewFile("paravol.view/1", PhantomHead(), VIEW.camera, look=ScopeLook())
    look = exposed(scope, 3.0).look
    assert isinstance(look, ScopeLook)
    assert look.gain == 3.0
