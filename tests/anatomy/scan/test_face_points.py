import numpy as np
import pytest

from anatomy.scan.face_points import face_points
from renderers.scene.volume import Volume


def ball(radius: float) -> Volume:
    axis = np.arange(-100.0, 101.0, 2.0)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    off = radius - np.sqrt(x**2 + y**2 + z**2)
    return Volume(
        off.astype(np.float32), np.full(3, 2.0), np.full(3, -100.0), background=-1.0
    )


@pytest.mark.parametrize("radius", [80.0, 45.0])
def test_points_lie_on_the_front_and_apart(radius: float) -> None:
    found = face_points(ball(radius), np.array([0.0, -radius, 0.0]))
    assert list(found) == ["face 1", "face 2", "face 3", "face 4"]
    points = np.stack(list(found.values()))
    assert np.linalg.norm(points, axis=1) == pytest.approx(np.full(4, radius), abs=0.1)
    assert (points[:, 1] < 0).all()
    gaps = sorted(
        float(np.linalg.norm(a - b)) for i, a in enumerate(points) for b in points[:i]
    )
    # a wrong order cannot be mistaken for the right one
    assert min(np.diff(gaps)) > 0.5


def test_what_is_not_in_the_scan_is_left_out() -> None:
    whole = ball(80.0)
    upper = Volume(
        np.asarray(whole.values)[50:], whole.spacing_mm, np.array([-100.0, -100, 0]),
        background=-1.0,
    )  # fmt: skip
    assert list(face_points(upper, np.array([0.0, -80, 0]))) == [
        "face 1", "face 2", "face 3"
    ]  # fmt: skip
