from typing import Any

import pytest

from renderers.shading import CameraSettings


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"focus_mm": 0.0}, "focus"),
        ({"soft_px": 2.0, "softer_px": 1.0}, "blur widths"),
        ({"knee": 1.5}, "knee"),
    ],
)
def test_impossible_cameras_are_refused(wrong: dict[str, Any], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        CameraSettings(**wrong)
