"""Air of heads made of balls and tubes, and of a phantom."""

import numpy as np
import pytest
from numpy.typing import NDArray

from anatomy.scan.airways import air_distance, find_airways, part_middles, skin_weight
from renderers.scene.volume import Volume

SPACING = 1.0


def head(
    *, nostril_mm: float = 4.0, sinus: bool = True, noise: float = 0.0
) -> tuple[Volume, NDArray[np.float64]]:
    """A ball of tissue with a cave, tubes from the cave to the face, and a sinus.

    Also the exact signed distance to air, negative in air.
    """
    axis = np.arange(-48.0, 49.0, SPACING)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    air = -(np.sqrt(x**2 + y**2 + z**2) - 36)
    cave = np.sqrt(x**2 + (y / 2) ** 2 + z**2) - 7
    air = np.minimum(air, cave)
    for side in (-6, 6):
        tube = np.maximum(np.hypot(x - side, z) - nostril_mm, y)
        air = np.minimum(air, tube)
    if sinus:
        air = np.minimum(air, np.sqrt((x - 20) ** 2 + y**2 + z**2) - 6)
    hu = np.clip(-480 + 520 * air / (SPACING / 2), -1000, 40)
    hu += noise * np.random.default_rng(1).normal(size=hu.shape)
    volume = Volume(
        hu.astype(np.float32),
        np.full(3, SPACING),
        np.full(3, -48.0),
        background=-1000.0,
    )
    return volume, air


def test_airway_sinus_and_nostrils_are_told_apart() -> None:
    volume, _ = head()
    found = find_airways(volume)
    tube_ml = 2 * np.pi * 4**2 * 30 / 1000
    cave_ml = 4 / 3 * np.pi * 7**3 * 2 / 1000
    assert 0.6 * (tube_ml + cave_ml) < found.airway_ml < 1.1 * (tube_ml + cave_ml)
    (sinus,) = found.cavities
    assert sinus.center_mm == pytest.approx([20, 0, 0], abs=0.3)
    assert sinus.volume_ml == pytest.approx(4 / 3 * np.pi * 6**3 / 1000, rel=0.05)
    assert len(found.openings) == 2
    assert all(opening.is_nostril for opening in found.openings)
    places = [opening.center_mm for opening in found.openings]
    for place, side in zip(sorted(places, key=lambda p: p[0]), (-6, 6), strict=True):
        assert place[[0, 2]] == pytest.approx([side, 0], abs=1.0)
        assert -40 < place[1] < -25
    assert found.notes == ()
    labels = found.labels.values
    assert labels[48, 48, 48] == 1
    assert labels[48, 48, 68] == 2
    assert labels[2, 2, 2] == 0
    assert labels[48, 70, 48] == 0


def test_the_surface_is_where_it_was_put() -> None:
    volume, exact = head()
    distance = air_distance(find_airways(volume)).values
    near = np.abs(exact) < 1.0
    error = np.abs(distance - exact)[near]
    assert np.median(error) < 0.05
    # edges between tubes and ball are creases
    assert np.percentile(error, 95) < 0.4
    assert np.array_equal(np.sign(distance)[~near], np.sign(exact)[~near])


def test_noise_leaves_no_specks() -> None:
    clean = find_airways(head()[0])
    noisy = find_airways(head(noise=150)[0])
    # the field has as many air spaces as without noise
    assert len(noisy.cavities) == len(clean.cavities)
    assert noisy.airway_ml == pytest.approx(clean.airway_ml, rel=0.1)
    flips = (noisy.field.values < 0) != (clean.field.values < 0)
    deep = np.abs(head()[1]) > 1.5
    assert not (flips & deep).any()


def test_a_cut_face_is_said() -> None:
    """A slit too narrow for the ball, but far too long for a nostril."""
    volume, _ = head(sinus=False)
    axis = np.arange(-48.0, 49.0, SPACING)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    slit = (np.abs(z) < 5) & (np.abs(x) < 30) & (y < 0)
    cut = volume.with_values(
        np.where(slit, -1000, volume.values).astype(np.float32), -1000.0
    )
    found = find_airways(cut)
    assert any("more than nostrils do" in note for note in found.notes)
    assert not any(opening.is_nostril for opening in found.openings)


def test_skin_is_outside_and_mucosa_inside() -> None:
    found = find_airways(head()[0])
    weight = skin_weight(found)
    assert weight[48, 2, 48] == 255
    assert weight[48, 48, 48] == 0


def test_a_head_without_air_is_refused() -> None:
    solid = Volume(
        np.full((20, 20, 20), 40, np.float32),
        np.ones(3),
        np.zeros(3),
        background=-1000.0,
    )
    with pytest.raises(ValueError, match="no air inside"):
        find_airways(solid)


def test_voxels_must_be_cubes() -> None:
    flat = Volume(
        np.zeros((4, 4, 4), np.float32),
        np.array([1, 1, 2.0]),
        np.zeros(3),
        background=0.0,
    )
    with pytest.raises(ValueError, match="cubic"):
        find_airways(flat)


def test_middles_of_parts_are_their_centres_of_mass() -> None:
    parts = np.random.default_rng(0).integers(0, 6, (7, 8, 9)).astype(np.int32)
    parts[parts == 3] = 0
    mine = part_middles(parts)
    for part in (1, 2, 4, 5):
        assert mine[part] == pytest.approx(np.argwhere(parts == part).mean(axis=0))
    assert np.array_equal(mine[3], np.zeros(3))
