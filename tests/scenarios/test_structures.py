import numpy as np
import pytest

from renderers.scene import Volume
from scenarios import Session, Structures, shaft_clearance, tip_frame
from scenarios.endoscope import Endoscope
from scenarios.sample import Sample
from scenarios.structures import MUCOSA, TISSUE

SEPTUM, LINING = 14, 10
PLACES = {"nasal valve, right": np.array([-6.0, 0.0, 0.0])}


def cleft(landmarks: dict[str, np.ndarray] | None = None) -> Structures:
    """Air between x = -6 and 6; cartilage under 1 mm of lining at the positive side."""
    n, h = 61, 0.5
    x = (np.arange(n) - n // 2) * h
    origin = np.full(3, x[0])
    distance = np.broadcast_to(np.abs(x) - 6.0, (n, n, n)).astype(np.float32)
    layers = np.where(np.abs(x) < 6.0, 1, LINING)
    layers[x > 7.0] = SEPTUM
    labels = np.broadcast_to(layers, (n, n, n)).astype(np.uint8)
    names = {1: "nasal air", LINING: "mucosa", SEPTUM: "septal cartilage"}
    spacing = np.full(3, h)
    return Structures.of(
        Volume(distance, spacing, origin, background=9.0),
        Volume(labels, spacing, origin, background=0.0),
        names,
        PLACES if landmarks is None else landmarks,
    )


def touched(structures: Structures, x_mm: float, z_mm: float = 0.0) -> str:
    frame = tip_frame(np.array([x_mm, 0.0, z_mm]), np.array([0.0, 1.0, 0.0]))
    clearance = shaft_clearance(structures.distance, frame, 1.0, 10.0)
    assert clearance.gap_mm < 0.0
    return structures.touched(clearance)


@pytest.mark.parametrize("depth_mm", [0.1, 0.5, 1.5])
def test_lining_has_the_name_of_what_it_covers(depth_mm: float) -> None:
    assert touched(cleft(), 5.0 + depth_mm) == "septum"


@pytest.mark.parametrize("depth_mm", [0.1, 0.5, 1.5])
def test_lining_of_nothing_named_has_that_of_the_nearest_landmark(
    depth_mm: float,
) -> None:
    assert touched(cleft(), -5.0 - depth_mm) == "mucosa near nasal valve, right"
    far = {"choana": np.array([0.0, 0.0, 60.0])}
    assert touched(cleft(far), -5.0 - depth_mm) == MUCOSA
    assert touched(cleft({}), -5.0 - depth_mm) == TISSUE


def test_the_hash_tells_heads_apart_that_are_named_differently() -> None:
    assert cleft().sha256() == cleft().sha256()
    assert cleft().sha256() != cleft({}).sha256()


def test_a_session_scores_and_shows_what_is_touched() -> None:
    structures = cleft()
    scope = Endoscope(
        diameter_mm=2.0, angle_deg=0.0, field_of_view_deg=80.0, ring_radius_mm=0.7
    )
    session = Session(scope, np.eye(4), structures.distance, {}, (32, 32), structures)
    for i, x_mm in enumerate((0.0, 5.2, 5.4, 0.0)):
        pose = tip_frame(np.array([x_mm, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
        sample = Sample(i * 0.1, pose, 0.0, np.zeros(3), np.array([0.0, 1.0, 0.0]), 0)
        session.step(sample)
        assert session.view(sample).touched == ("septum" if x_mm else "")
    score = session.score()
    assert score.worst_structure == "septum"
    assert score.worst_depth_mm == pytest.approx(0.4, abs=1e-5)
    assert score.touched_s == {"septum": pytest.approx(0.2)}
