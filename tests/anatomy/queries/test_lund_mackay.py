import itertools

import msgspec
import numpy as np
import pytest

from anatomy.phantom.parameters import SINUSES, Opacity, PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom
from anatomy.phantom.variants import with_findings
from anatomy.queries.lund_mackay import lund_mackay, trapped_sinuses
from anatomy.tissue import Label, Side

SPACING_MM = 1.0
REQUESTS = (
    (Opacity(maxillary=1, frontal=2), Opacity()),
    (Opacity(sphenoid=1, ostiomeatal=2, anterior_ethmoid=1), Opacity(frontal=1)),
    (
        Opacity(posterior_ethmoid=1, anterior_ethmoid=2, polyps=3),
        Opacity(maxillary=2, sphenoid=2),
    ),
    (
        Opacity(**dict.fromkeys((*SINUSES, "ostiomeatal"), 2), polyps=4),
        Opacity(**dict.fromkeys(SINUSES, 1)),
    ),
)


@pytest.fixture(scope="module")
def twin() -> Phantom:
    return build_phantom(PhantomParameters(seed=3), SPACING_MM)


@pytest.mark.parametrize(
    "request_",
    [REQUESTS[3], *(pytest.param(r, marks=pytest.mark.slow) for r in REQUESTS[:3])],
)
def test_the_recounted_score_is_the_one_asked_for(
    twin: Phantom, request_: tuple[Opacity, Opacity]
) -> None:
    head = PhantomParameters(seed=3, opacity=request_)
    found = lund_mackay(build_phantom(head, SPACING_MM), twin)
    for side, wanted in zip((Side.RIGHT, Side.LEFT), request_, strict=True):
        assert found[side] == msgspec.structs.replace(wanted, polyps=0)


def test_a_healthy_head_scores_nothing(twin: Phantom) -> None:
    assert all(score.total == 0 for score in lund_mackay(twin, twin).values())


def test_polyps_grow_with_their_grade() -> None:
    box = ((-14.0, 2.0), (8.0, 50.0), (0.0, 34.0))
    sizes = [
        np.count_nonzero(
            build_phantom(
                PhantomParameters(opacity=(Opacity(polyps=grade), Opacity())),
                0.8,
                field_mm=box,
            ).labels.values
            == Label.POLYP
        )
        for grade in range(5)
    ]
    assert sizes[0] == 0
    assert all(b > 1.3 * a for a, b in itertools.pairwise(sizes[1:]))


def test_a_twin_on_another_grid_is_refused(twin: Phantom) -> None:
    box = ((-14.0, 2.0), (8.0, 50.0), (0.0, 34.0))
    other = build_phantom(PhantomParameters(seed=3), 1.0, field_mm=box)
    with pytest.raises(ValueError, match="must share the grid"):
        lund_mackay(twin, other)


FRONT_MM = ((-30.0, 30.0), (-20.0, 36.0), (14.0, 82.0))
"""Frontal sinuses, recesses and the front of the nose, LPS."""


def test_a_sinus_behind_a_full_neighbour_is_named() -> None:
    """The frontal sinus drains through the anterior ethmoid."""
    head = with_findings(PhantomParameters(), ["anterior-ethmoid:left=2"])
    found = build_phantom(head, 1.0, field_mm=FRONT_MM)
    assert trapped_sinuses(found) == ("frontal, left",)


def test_in_a_healthy_head_every_sinus_drains() -> None:
    found = build_phantom(PhantomParameters(), 1.0, field_mm=FRONT_MM)
    assert trapped_sinuses(found) == ()
