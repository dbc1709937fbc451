from functools import cache

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from anatomy.frame import lps_from_ras
from anatomy.phantom.maxillary import WINDOW_MM
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom, distance_at
from anatomy.phantom.variants import with_findings
from anatomy.tissue import AIR_LABELS, Label, Side

HEAD = PhantomParameters(septal_deviation_mm=0.0)
SPACING_MM = 0.8
SINUS_MM = ((-44.0, -11.0), (4.0, 54.0), (-12.0, 34.0))
"""The right maxillary sinus, LPS."""
MEATUS_MM = ((-15.0, -1.0), (6.0, 52.0), (-2.0, 32.0))


def sinus_with(*words: str) -> Phantom:
    head = with_findings(HEAD, words)
    return build_phantom(head, SPACING_MM, field_mm=SINUS_MM)


@pytest.mark.parametrize(
    ("posture", "axis", "up"), [("supine", 1, -1), ("upright", 0, 1)]
)
def test_fluid_ends_in_a_plane_normal_to_gravity(
    posture: str, axis: int, up: int
) -> None:
    """axis: of gravity in (z, y, x) arrays; LPS y grows towards the back."""
    share = 0.4
    found = sinus_with(f"fluid:maxillary:right={share}", f"posture={posture}")
    labels = found.labels.values
    fluid, air = labels == Label.MUCUS, labels == Label.MAXILLARY_AIR
    above = np.roll(air, -up, axis=axis)
    # mucosa's label may lie between: up to two voxels over the fluid there is air
    above |= np.roll(above, -up, axis=axis)
    top = np.nonzero(fluid & above & ~np.roll(fluid, -up, axis=axis))
    assert len(top[0]) > 100
    height = up * found.spacing_mm * top[axis]
    assert np.abs(height - np.median(height)).max() <= SPACING_MM + 1e-6
    held = np.count_nonzero(fluid)
    assert held / (held + np.count_nonzero(air)) == pytest.approx(share, abs=0.07)


def test_fluid_colours_what_it_wets_and_nothing_else() -> None:
    """Walls of other airs that lie below its level keep their blood."""
    beside = ((-24.0, -1.0), (24.0, 56.0), (14.0, 42.0))
    words = ("fluid:maxillary:right=0.4",)
    wet, dry = (
        build_phantom(with_findings(HEAD, given), SPACING_MM, field_mm=beside)
        for given in (words, ())
    )
    paler = wet.blood.values < dry.blood.values - 2.0
    fluid = wet.labels.values == Label.MUCUS
    assert np.count_nonzero(paler & fluid) > 100
    away_mm = SPACING_MM * distance_transform_edt(~fluid)
    # Mucosa of 0.4 mm lies over the fluid, and labels are as coarse as voxels.
    assert away_mm[paler].max() < 0.8 + np.sqrt(3.0) * SPACING_MM


def test_a_cyst_is_a_dome_on_the_floor() -> None:
    radius = 8.0
    found = sinus_with(f"cyst:maxillary:right={radius}")
    k, j, i = np.nonzero(found.labels.values == Label.MUCUS)
    whole = np.count_nonzero(sinus_with().labels.values == Label.MAXILLARY_AIR)
    assert 0.02 < len(k) / whole < 0.3
    for at in (j, i):
        assert SPACING_MM * np.ptp(at) <= 2 * radius + SPACING_MM
    floor = np.nonzero(sinus_with().labels.values == Label.MAXILLARY_AIR)[0].min()
    assert SPACING_MM * (k.min() - floor) < 2.0


@pytest.mark.parametrize("thick", [4.0, pytest.param(1.2, marks=pytest.mark.slow)])
def test_a_swollen_lining_leaves_that_much_less_room(thick: float) -> None:
    """The model's zero set moves inwards by the swelling where walls are flat."""
    well, ill = (
        sinus_with(*words) for words in ((), (f"swelling:maxillary:right={thick}",))
    )
    deep = -well.distance.values[well.labels.values == Label.MAXILLARY_AIR].min()
    left = -ill.distance.values[ill.labels.values == Label.MAXILLARY_AIR].min()
    assert deep - left == pytest.approx(thick, abs=1.0)
    # Behind it the sinus still has its wall of bone.
    bone = [
        np.count_nonzero(np.isin(p.labels.values, (Label.THICK_BONE,)))
        for p in (well, ill)
    ]
    assert bone[1] > 0.9 * bone[0]


@pytest.mark.parametrize("area", [25.0, 70.0, 130.0])
def test_an_antrostomy_has_the_area_asked_for(area: float) -> None:
    head = with_findings(HEAD, [f"antrostomy:left={area}"])
    step = 0.2
    # Ethmoid cells lie above.
    y, z = np.meshgrid(np.arange(-50, -14, step), np.arange(12, 25.4, step))
    for side, wanted in ((1.0, 0.0), (-1.0, area)):
        ras = np.stack([np.full_like(y, side * WINDOW_MM), y, z], axis=-1)
        hole = np.count_nonzero(distance_at(head, lps_from_ras(ras)) < 0) * step**2
        if wanted:
            assert hole == pytest.approx(wanted, rel=0.12)
        else:
            assert hole < 17.0


def test_an_antrostomy_takes_the_uncinate_of_its_side_alone() -> None:
    head = with_findings(HEAD, ["antrostomy:left=80"])
    found = build_phantom(head, 1.0, field_mm=((-14, 14), (14, 34), (18, 36)))
    uncinate = found.labels.values == Label.UNCINATE
    right, left = (
        np.count_nonzero(uncinate & (found.sides.values == side))
        for side in (Side.RIGHT, Side.LEFT)
    )
    assert left < 0.4 * right
    assert "uncinate process, right" in found.landmarks
    assert "uncinate process, left" not in found.landmarks


@cache
def meatus_with(grade: int) -> Phantom:
    head = with_findings(HEAD, [f"polyps:right={grade}"])
    return build_phantom(head, 0.6, field_mm=MEATUS_MM)


def lowest_mm(found: Phantom, label: Label) -> float:
    k = np.nonzero(found.labels.values == label)[0].min()
    return float(found.ct.origin_mm[2] + found.spacing_mm * k)


def free_share(found: Phantom) -> float:
    """Return the share of the lower cavity, below the middle turbinate, that is air."""
    z = found.ct.origin_mm[2] + found.spacing_mm * np.arange(found.ct.shape[0])
    low = np.isin(found.labels.values[z < 17.0], list(AIR_LABELS))
    return float(np.count_nonzero(low))


def test_polyps_reach_the_landmark_of_their_grade_and_not_the_next() -> None:
    """Middle meatus; below the middle turbinate; the inferior one's edge; the floor."""
    well = meatus_with(0)
    middle = lowest_mm(well, Label.MIDDLE_TURBINATE)
    inferior = lowest_mm(well, Label.INFERIOR_TURBINATE)
    one, two, three, four = (
        lowest_mm(meatus_with(grade), Label.POLYP) for grade in (1, 2, 3, 4)
    )
    step = well.spacing_mm
    assert one >= middle - step
    assert inferior + 3.0 < two < middle - step
    assert three <= inferior + step
    assert four <= three - step
    free = [free_share(meatus_with(grade)) for grade in range(5)]
    assert free[3] > 0.5 * free[0]
    assert free[4] < 0.45 * free[0]


def test_congestion_narrows_the_nose() -> None:
    room = []
    for words in ((), ("congestion=1",)):
        head = with_findings(HEAD, words)
        found = build_phantom(head, 0.8, field_mm=MEATUS_MM)
        room.append(np.count_nonzero(found.labels.values == Label.NASAL_AIR))
    assert 0.3 < room[1] / room[0] < 0.8
