import numpy as np
import pytest

from anatomy.phantom.nose import septum_face
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.turbinates import LATERAL_MM, MEDIAL_MM, turbinates
from anatomy.phantom.variants import with_variants
from anatomy.tissue import Side

PLAIN = PhantomParameters()
MEDIAL = with_variants(PLAIN, ["medialised-turbinate:right"])
LATERAL = with_variants(PLAIN, ["lateralised-turbinate:right"])
U = np.arange(0.0, 12.0, 0.01)


def _faces(head: PhantomParameters, depth: float, height: float) -> tuple[float, float]:
    """Return u of the medial and lateral face of the right middle turbinate."""
    places = np.stack([U, np.full_like(U, -depth), np.full_like(U, height)])
    inside = U[turbinates(head, Side.RIGHT).middle.evaluate(places) < 0.0]
    return float(inside[0]), float(inside[-1])


@pytest.mark.parametrize("height", [26.0, 28.0, 30.0])
def test_a_medialised_turbinate_leaves_the_meatus_wider(height: float) -> None:
    """As thick as before, it lies nearer to the septum, which it does not reach."""
    plain, medial = (_faces(head, 28.0, height) for head in (PLAIN, MEDIAL))
    assert 0.7 * MEDIAL_MM < plain[1] - medial[1] <= MEDIAL_MM
    assert medial[1] - medial[0] == pytest.approx(plain[1] - plain[0], abs=0.05)
    place = np.array([[0.0], [-28.0], [height]])
    face = float(septum_face(MEDIAL, Side.RIGHT).evaluate(place)[0])
    assert medial[0] > face + 0.3


def test_a_lateralised_turbinate_leaves_the_way_to_the_sphenoid_wider() -> None:
    plain, lateral = (_faces(head, 38.0, 23.5) for head in (PLAIN, LATERAL))
    assert 0.7 * LATERAL_MM < lateral[0] - plain[0] <= LATERAL_MM + 0.05


@pytest.mark.parametrize("head", [MEDIAL, LATERAL])
@pytest.mark.parametrize("place", [(4.9, -30, 47), (5.0, -45, 43), (5.2, -10, 36)])
def test_the_roots_of_a_bent_turbinate_stay(
    place: tuple[float, float, float], head: PhantomParameters
) -> None:
    plain, bent = (
        turbinates(each, Side.RIGHT).middle.evaluate(np.array(place)[:, None])[0]
        for each in (PLAIN, head)
    )
    assert bent == pytest.approx(plain, abs=0.45)


def test_only_the_side_asked_for_is_medialised() -> None:
    places = np.random.default_rng(1).uniform((2, -50, 15), (12, -8, 45), (500, 3)).T
    left, before = (
        turbinates(head, Side.LEFT).middle.evaluate(places) for head in (MEDIAL, PLAIN)
    )
    assert np.array_equal(left, before)
