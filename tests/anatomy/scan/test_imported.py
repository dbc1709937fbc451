"""A skull, the same with soft tissue, and what is drawn on each."""

import numpy as np
import pytest
from numpy.typing import NDArray

from anatomy.scan.imported import BARE, bare_bone, import_head
from anatomy.scan.scan import Modality, Scan
from anatomy.tissue import TISSUES, encode_blood
from renderers.scene.volume import Volume

STEP = 1.5
AXIS = np.arange(-60.0, 61.0, STEP)
Z, Y, X = np.meshgrid(AXIS, AXIS, AXIS, indexing="ij")
AWAY = np.sqrt(X**2 + Y**2 + Z**2)


def air_of_a_head() -> NDArray[np.float64]:
    """Signed distance, about, to the air of a ball with a cave and two nostrils."""
    air = np.minimum(45 - AWAY, np.sqrt(X**2 + (Y / 2) ** 2 + Z**2) - 9)
    for side in (-7, 7):
        air = np.minimum(air, np.maximum(np.hypot(X - side, Z) - 4.5, Y))
    return np.asarray(air)


def scan_of(solid_hu: float, *, bone_behind: bool = False) -> Scan:
    """Give a head of one material; bone_behind: with bone 8 mm below every surface."""
    air = air_of_a_head()
    hu = np.clip(-480 + (solid_hu + 480) * air / (STEP / 2), -1000, solid_hu)
    if bone_behind:
        hu[air > 8] = 900
    values = np.rint(hu).astype(np.int16)
    return Scan(Volume(values, np.full(3, STEP), np.full(3, -60.0)), Modality.CT, ())


def hollow() -> Scan:
    """Give a head of soft tissue without a brain, whose face is closed."""
    air = np.minimum(52 - AWAY, np.sqrt(X**2 + Y**2 + (Z - 5) ** 2) - 34)
    hu = np.clip(-480 + 520 * air / (STEP / 2), -1000, 40)
    values = np.rint(hu).astype(np.int16)
    return Scan(Volume(values, np.full(3, STEP), np.full(3, -60.0)), Modality.CT, ())


def test_bone_without_mucosa_is_bone_and_has_no_skin() -> None:
    head = import_head(scan_of(900), 1.5)
    assert BARE in head.notes
    bone = int(encode_blood(np.array(TISSUES["bone"].blood_fraction)))
    near = np.abs(np.asarray(head.distance.values)) < 1.5
    assert set(np.unique(head.blood.values[near])) == {bone}
    # vibrissae grow on skin alone
    assert head.skin.values[near].max() == 0
    # a skull has no nostrils, and nothing is made up
    assert head.approach is None
    assert not any(name.startswith(("nostril", "entrance")) for name in head.landmarks)
    assert any(
        "no nostril was found: the head is bare bone" in n and "--pivot x y z" in n
        for n in head.notes
    )
    named = import_head(scan_of(900), 1.5, pivot_mm=np.array([7.0, -30, 0]))
    assert named.approach is not None


@pytest.mark.parametrize("bone_behind", [False, True])
def test_a_head_with_soft_tissue_is_mucosa(bone_behind: bool) -> None:
    head = import_head(scan_of(40, bone_behind=bone_behind), 1.5)
    assert BARE not in head.notes
    mucosa = int(encode_blood(np.array(TISSUES["mucosa"].blood_fraction)))
    assert (head.blood.values == mucosa).all()
    assert head.skin.values.max() == 255
    assert head.approach is not None
    assert "nostril, left" in head.landmarks


def test_walls_thinner_than_the_first_depth_are_seen() -> None:
    distance = np.full((30, 30, 30), -3.0, np.float32)
    distance[:, :, 10:14] = [0.2, 0.7, 0.7, 0.2]
    hu = np.where(distance > 0, 1100, -1000).astype(np.int16)
    grid = Volume(hu, np.full(3, 0.5), np.zeros(3))
    marked = bare_bone(grid, grid.with_values(distance, 6.0))
    assert marked[:, :, 9:15].all()
    assert not marked[:, :, 22:].any()


def test_an_empty_skull_is_no_nose() -> None:
    """Its longest free way leads through the vault."""
    head = import_head(hollow(), 1.5)
    assert head.approach is None
    assert not any(name.startswith(("nostril", "entrance")) for name in head.landmarks)
    assert any("more than a nose and a throat hold" in note for note in head.notes)


def test_a_pivot_in_tissue_is_refused_with_the_nearest_air() -> None:
    with pytest.raises(
        ValueError, match=r"\[20.0, 0.0, 0.0\] mm lies in tissue"
    ) as told:
        import_head(scan_of(40), 1.5, pivot_mm=np.array([20.0, 0, 0]))
    _, _, named = str(told.value).partition("--pivot ")
    place = np.array([float(word) for word in named.split()])
    # the left nostril reaches to 11.5 mm
    assert place == pytest.approx([10.5, 0, 0], abs=2.0)
    head = import_head(scan_of(40), 1.5, pivot_mm=place)
    assert head.distance.sample(place) < 0
