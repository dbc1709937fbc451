"""Frames that are not quite at right angles, as headers and converters leave them."""

from pathlib import Path

import nibabel
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anatomy.files.volume_frame import squared
from anatomy.files.volumes import load_layers, read_volume
from tests.anatomy.volume_files import write_volume

TURN = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1.0]])

SPACING = np.array([0.5, 0.5, 1.25])


def sheared(skew: float) -> np.ndarray:
    """Return a frame whose slices are shifted along y, as a tilted gantry does."""
    axes = TURN.copy()
    axes[:, 2] += skew * TURN[:, 1]
    axes[:, 2] /= np.linalg.norm(axes[:, 2])
    frame: np.ndarray = np.column_stack([axes * SPACING, [-30.0, 20.0, 7.0]])
    return frame


def field(frame: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return a linear field at each voxel, by where the frame puts it."""
    k, j, i = np.indices(shape)
    places = np.einsum("ab,bkji->akji", frame[:, :3], np.stack([i, j, k]))
    places += frame[:, 3, None, None, None]
    values: np.ndarray = np.einsum("a,akji->kji", [3.0, -2.0, 5.0], places)
    return values.astype(np.float32)


@given(skew=st.floats(-0.09, 0.09), seed=st.integers(0, 99))
@settings(max_examples=25, deadline=None)
def test_a_linear_field_stays_where_it_is(skew: float, seed: int) -> None:
    """Whatever is done to the frame, a place holds what it held, to the error told."""
    rng = np.random.default_rng(seed)
    shape = tuple(int(n) for n in rng.integers(6, 40, 3))
    frame = sheared(skew)
    grid = squared("a", [field(frame, shape)], frame, 1)
    assert grid.direction.T @ grid.direction == pytest.approx(np.eye(3), abs=1e-12)
    straight = np.column_stack([grid.direction * grid.spacing_mm, grid.origin_mm])
    found = grid.layers[0]
    expected = field(straight, found.shape)
    # what the sheared volume did not hold has been filled
    inside = found != found.min()
    moved = np.abs(found - expected)[inside]
    is_resampled = any("resampled" in note for note in grid.notes)
    # the field's slope is 6.2 a millimetre
    most = 0.02 if is_resampled else 6.2 * 0.25 + 0.02
    assert moved.max() <= most
    assert inside.mean() > 0.3
    assert is_resampled or found.shape == shape


@pytest.mark.parametrize(
    ("skew", "words"),
    [(0.0, []), (0.006, ["right angles, which moves"]), (0.08, ["resampled"])],
)
@pytest.mark.parametrize("ending", ["nii.gz", "nrrd"])
def test_small_shears_are_read_and_told(
    tmp_path: Path, skew: float, words: list[str], ending: str
) -> None:
    shape = (60, 70, 80)
    frame, file = sheared(skew), tmp_path / f"a.{ending}"
    save(file, field(frame, shape), frame)
    volume, notes = read_volume(file)
    assert len(notes) == len(words)
    assert all(told in note for told, note in zip(words, notes, strict=True))
    # in the middle nothing has moved
    middle = frame[:, :3] @ [40, 35, 30] + frame[:, 3]
    assert float(volume.sample(middle)) == pytest.approx(
        float(np.dot([3.0, -2.0, 5.0], middle)), abs=0.2
    )


def save(file: Path, values: np.ndarray, frame: np.ndarray) -> None:
    """Write a sheared frame, which SimpleITK does not."""
    if file.name.endswith("nrrd"):
        axes = [f"({','.join(f'{v:.9g}' for v in axis)})" for axis in frame.T]
        write_volume(
            file,
            values.astype("<f4").tobytes(),
            type="float",
            sizes=" ".join(str(n) for n in values.shape[::-1]),
            space_directions=" ".join(axes[:3]),
            space_origin=axes[3],
        )
        return
    affine = np.vstack([np.diag([-1.0, -1.0, 1.0]) @ frame, [0, 0, 0, 1]])
    image = nibabel.Nifti1Image(values.T, None)
    image.set_sform(affine, 1)
    image.header["pixdim"][1:4] = SPACING
    image.to_filename(file)


@pytest.mark.parametrize("digits", [2, 3, 4])
def test_few_digits_of_a_header_are_enough(tmp_path: Path, digits: int) -> None:
    shape = (60, 70, 80)
    exact = sheared(0.0)
    rounded = exact.round(digits)
    save(tmp_path / "a.nii", field(exact, shape), rounded)
    volume, _ = read_volume(tmp_path / "a.nii")
    assert volume.shape == shape
    # what the last digit means at the furthest corner, about the middle
    apart = np.abs(volume.world_from_voxel[:3] - rounded) @ [80, 70, 60, 1]
    assert apart.max() < 80 * 0.5 * 10.0**-digits + 1e-3


def test_labels_are_not_mixed(tmp_path: Path) -> None:
    values = np.random.default_rng(0).choice([0, 7, 90], (40, 40, 40))
    save(tmp_path / "a.nrrd", values.astype(np.float32), sheared(0.08))
    (layer,) = load_layers(tmp_path / "a.nrrd", 0.0)
    assert set(np.unique(layer.values)) == {0, 7, 90}
