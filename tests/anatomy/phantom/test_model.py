import numpy as np
import pytest

from anatomy.frame import lps_from_ras
from anatomy.phantom.air import distance_at_points
from anatomy.phantom.model import BAND_MM, build_model
from anatomy.phantom.parameters import PhantomParameters
from anatomy.tissue import Side

SMOOTH = PhantomParameters(unevenness=0.0, septal_deviation_mm=0.0)
CASES = {
    "smooth": SMOOTH,
    "operated": PhantomParameters(
        unevenness=0.0, septal_deviation_mm=0.0, uncinectomy=True, congestion=0.5
    ),
}


def side_points(points: np.ndarray, side: Side) -> np.ndarray:
    sign = 1.0 if side == Side.RIGHT else -1.0
    flipped: np.ndarray = points * np.array([[sign], [1.0], [1.0]])
    return flipped


@pytest.mark.parametrize("case", CASES)
def test_kernels_and_expression_trees_agree_on_the_whole_head(case: str) -> None:
    model = build_model(CASES[case])
    ras = np.random.default_rng(1).uniform([-41, -80, -12], [41, 23, 78], (4000, 3)).T
    ras = ras.astype(np.float32).astype(np.float64)
    expected = np.min(
        [p.field.evaluate(side_points(ras, p.side)) for p in model.parts], axis=0
    )
    found = distance_at_points(model, lps_from_ras(ras.T))
    near = np.abs(expected) < 10
    assert np.abs(found - expected)[near].max() < 1e-3


def test_no_part_is_steeper_than_it_says() -> None:
    # Bricks are left out on the strength of these bounds; they count where a part's
    # value decides, that is up to the reach of a brick beyond the band.
    model = build_model(SMOOTH)
    rng = np.random.default_rng(2)
    a = rng.uniform([-5, -80, -12], [41, 23, 78], (60_000, 3)).T
    b = a + rng.normal(0, 2.0, a.shape)
    length = np.linalg.norm(b - a, axis=0)
    for part in model.parts:
        if part.side == Side.LEFT:
            continue
        va, vb = part.field.evaluate(a), part.field.evaluate(b)
        relevant = np.minimum(va, vb) < BAND_MM
        slope = np.abs(va - vb)[relevant] / length[relevant]
        assert slope.max(initial=0.0) <= part.steepness, part.name


def test_marks_that_tint_reads_fade_within_the_band() -> None:
    tint = build_model(SMOOTH).tables.tint
    parts_rows = tint[:, 0] < 8
    assert np.all((tint[:, 1] + tint[:, 2])[parts_rows] < BAND_MM)
