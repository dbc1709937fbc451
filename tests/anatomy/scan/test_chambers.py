"""Sinuses of made heads and of a phantom, open or closed."""

import numpy as np
import pytest

from anatomy.phantom.phantom import Phantom
from anatomy.scan.airways import air_distance, find_airways
from anatomy.scan.chambers import AirSpaces, find_chambers
from anatomy.scan.imported import import_head
from anatomy.scan.midplane import Midplane, find_midplane
from anatomy.scan.scan import Modality, Scan
from anatomy.tissue import Label, Side
from renderers.scene.volume import Volume


def head(ostium_mm: float, midplane_mm: float = 0.0) -> AirSpaces:
    """A ball of tissue, two tubes for a nose, and a sinus with an ostium on its left.

    ostium_mm: radius of the ostium; 0 is none.
    """
    axis = np.arange(-48.0, 49.0)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    air = -(np.sqrt(x**2 + y**2 + z**2) - 40)
    for side in (-5, 5):
        tube = np.maximum(np.hypot((x - side) / 0.7, z / 2) - 4, y - 20)
        air = np.minimum(air, tube)
    # they meet behind the septum, too narrow for a ball
    behind = np.maximum(np.abs(x) - 6, np.maximum(np.abs(y - 17) - 3, np.abs(z) - 5))
    air = np.minimum(air, behind)
    air = np.minimum(air, np.sqrt((x - 22) ** 2 + y**2 + z**2) - 9)
    if ostium_mm:
        ostium = np.maximum(np.hypot(y, z) - ostium_mm, np.maximum(5 - x, x - 22))
        air = np.minimum(air, ostium)
    hu = np.clip(-480 + 1040 * air, -1000, 40).astype(np.float32)
    found = find_airways(Volume(hu, np.ones(3), np.full(3, -48.0)))
    plane = Midplane(np.array([1.0, 0, 0]), midplane_mm, 1.0)
    return find_chambers(found, air_distance(found), plane)


@pytest.mark.parametrize("ostium_mm", [0.0, 2.0, 3.0])
def test_a_sinus_is_a_chamber_whether_its_ostium_shows_or_not(ostium_mm: float) -> None:
    spaces = head(ostium_mm)
    (sinus,) = spaces.chambers
    assert sinus.is_open == (ostium_mm > 0)
    assert sinus.side is Side.LEFT
    assert sinus.center_mm == pytest.approx([22, 0, 0], abs=1)
    assert sinus.volume_ml == pytest.approx(4 / 3 * np.pi * 0.9**3, rel=0.1)
    labels = spaces.labels.values
    assert labels[48, 48, 70] == 2
    assert labels[48, 40, 53] == labels[48, 40, 43] == 1
    # a way to the throat does not lead through it
    assert spaces.passages()[48, 40, 53]
    assert not spaces.passages()[48, 48, 70]


def test_sides_are_those_of_the_midplane() -> None:
    assert head(0.0, midplane_mm=22.0).chambers[0].side is Side.MIDLINE
    assert head(0.0, midplane_mm=40.0).chambers[0].side is Side.RIGHT
    assert head(0.0, midplane_mm=22.0).passages()[48, 48, 70]


@pytest.mark.slow
def test_the_sinuses_of_a_phantom_are_found_in_its_ct(phantom: Phantom) -> None:
    """From the CT numbers alone, against the labels that the phantom knows."""
    head = import_head(Scan(phantom.ct, Modality.CT, ()), 1.0)
    plane = find_midplane(head.ct)
    assert np.degrees(np.arccos(plane.normal[0])) < 2
    assert abs(float(plane.aside(np.array([0.0, 30, 20])))) < 1.5
    mine = head.spaces.labels
    at = np.rint(
        (mine.origin_mm - phantom.labels.origin_mm) / phantom.labels.spacing_mm
    ).astype(int)
    assert np.allclose(
        mine.origin_mm, phantom.labels.origin_mm + at * phantom.labels.spacing_mm
    )
    window = tuple(slice(s, s + n) for s, n in zip(at[::-1], mine.shape, strict=True))
    truth = phantom.labels.values[window]
    sides = phantom.sides.values[window]
    for label, side in (
        (Label.MAXILLARY_AIR, Side.RIGHT),
        (Label.MAXILLARY_AIR, Side.LEFT),
    ):
        there = (truth == label) & (sides == side)
        found = np.bincount(mine.values[there], minlength=2)
        chamber = int(found[2:].argmax()) + 2
        overlap = 2 * found[chamber] / ((mine.values == chamber).sum() + there.sum())
        print(label.name, side.name, chamber, f"Dice {overlap:.3f}")
        assert overlap > 0.85
        assert head.spaces.chambers[chamber - 2].side is side
    assert head.approach is not None
    entrance = head.approach.pivot_mm
    assert abs(float(entrance[0])) < 15
    assert (
        np.linalg.norm(entrance - phantom.landmarks["nostril, right"].position_mm) < 20
        or np.linalg.norm(entrance - phantom.landmarks["nostril, left"].position_mm)
        < 20
    )
