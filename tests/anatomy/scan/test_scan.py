"""Scans as they come: what the numbers mean, and what is refused."""

import importlib
import zlib
from pathlib import Path

import numpy as np
import pytest

from anatomy.files.volumes import save_volume
from anatomy.scan.scan import Levels, Modality, isotropic, patient_box, read_scan
from renderers.scene.volume import Volume


def head(noise: float = 15.0) -> Volume:
    """A box of soft tissue with a shell of bone and a cave, in CT numbers."""
    hu = np.full((30, 40, 40), -1000.0)
    hu[3:27, 5:35, 5:35] = 40.0
    hu[5:25, 7:33, 7:33] = 900.0
    hu[6:24, 8:32, 8:32] = 40.0
    hu[10:20, 12:24, 15:25] = -1000.0
    hu += noise * np.random.default_rng(0).normal(size=hu.shape)
    return Volume(
        np.rint(hu).astype(np.int16), np.array([1.0, 1.0, 1.5]), np.array([3.0, -4, 5])
    )


def stored(volume: Volume, values: np.ndarray, file: Path) -> Path:
    save_volume(volume.with_values(values, 0.0), file)
    return file


@pytest.mark.parametrize("ending", ["nrrd", "nii.gz", "mha"])
def test_ct_numbers_stay(tmp_path: Path, ending: str) -> None:
    ct = head()
    scan = read_scan(stored(ct, np.asarray(ct.values), tmp_path / f"a.{ending}"))
    assert scan.modality is Modality.CT
    assert np.array_equal(scan.volume.values, np.maximum(ct.values, -1024))
    assert scan.volume.world_from_voxel == pytest.approx(ct.world_from_voxel, abs=1e-4)
    assert scan.notes == ()


def test_unsigned_storage_is_told_and_undone(tmp_path: Path) -> None:
    ct = head()
    raw = (np.maximum(np.asarray(ct.values), -1024) + 1024).astype(np.uint16)
    scan = read_scan(stored(ct, raw, tmp_path / "raw.nrrd"))
    assert scan.modality is Modality.CT
    assert np.array_equal(scan.volume.values, np.maximum(ct.values, -1024))
    assert scan.notes == ("stored values are CT numbers less 1024",)


def test_outside_the_scanners_circle_is_air(tmp_path: Path) -> None:
    ct = head()
    values = np.array(ct.values)
    values[:, :3, :3] = -32768
    values[0, 0, 0] = 32767
    scan = read_scan(stored(ct, values, tmp_path / "a.nrrd"))
    assert scan.volume.values[5, 1, 1] == -1024
    assert scan.volume.values[0, 0, 0] == 32767


@pytest.mark.parametrize("padding", [-2000, -3024, 63536, 65535])
@pytest.mark.parametrize("modality", [None, Modality.CT])
def test_padding_is_air_and_told(
    tmp_path: Path, padding: int, modality: Modality | None
) -> None:
    """A fifth of the picture, as a round field of view leaves it."""
    ct = head()
    raw = np.array(ct.values, np.int32) + 1024 * (padding > 0)
    raw[:, :8] = padding
    kind = np.uint16 if padding > 0 else np.int16
    raw = np.maximum(raw, np.iinfo(kind).min).astype(kind)
    file = stored(ct, raw, tmp_path / "a.nrrd")
    scan = read_scan(file, modality=modality)
    assert scan.modality is Modality.CT
    assert (scan.volume.values[:, :8] <= -1000).all()
    kept = np.maximum(ct.values[:, 8:], -1024)
    assert np.array_equal(scan.volume.values[:, 8:], kept)
    count = raw[:, :8].size
    assert sum(f"{count:,}" in n and str(padding) in n for n in scan.notes) == 1


def test_bright_mr_is_no_padding(tmp_path: Path) -> None:
    """An MR may use all of its words."""
    tissue = np.asarray(head(0).values) > -500
    rng = np.random.default_rng(2)
    values = np.where(tissue, rng.uniform(3e4, 6.5e4, tissue.shape), 0)
    values += np.abs(rng.normal(0, 300, tissue.shape))
    file = stored(head(), values.astype(np.uint16), tmp_path / "mr.nrrd")
    scan = read_scan(file)
    assert scan.modality is Modality.MR
    assert (scan.volume.values[tissue] > -480).mean() > 0.99
    assert not any("padding" in n or "no tissue" in n for n in scan.notes)


def test_mr_is_brought_onto_the_scale(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    tissue = np.asarray(head(0).values) > -500
    signal = np.where(tissue, 420.0, 0.0)
    noise = 20 * rng.normal(size=(2, *signal.shape))
    values = np.hypot(signal + noise[0], noise[1]).astype(np.float32)
    scan = read_scan(stored(head(), values, tmp_path / "mr.nii.gz"))
    assert scan.modality is Modality.MR
    assert "MR" in scan.notes[0]
    hu = scan.volume.values
    assert np.median(hu[tissue]) == pytest.approx(40, abs=25)
    assert (hu[~tissue] < -480).mean() > 0.995
    assert (hu[tissue] > -480).mean() > 0.999


def test_numbers_that_are_none_are_refused_or_counted(tmp_path: Path) -> None:
    ct = head()
    values = np.array(ct.values, np.float32)
    values[0, 0, :3] = np.nan
    values[0, 1, 0] = np.inf
    file = stored(ct, values, tmp_path / "a.nrrd")
    with pytest.raises(ValueError, match="4 voxels are no numbers"):
        read_scan(file)
    scan = read_scan(file, nonfinite_is_air=True)
    assert scan.notes == ("4 voxels that were no numbers are taken for air",)
    assert (scan.volume.values[0, 0, :3] <= -1000).all()
    assert scan.volume.values[0, 1, 0] <= -1000


@pytest.mark.parametrize("offset", [0, 1024])
@pytest.mark.parametrize("window", [(-200, 200), (-160, 240), (-400, 1500)])
@pytest.mark.parametrize("noise", [0.0, 15.0])
def test_a_ct_cut_off_at_a_window_is_no_mr(
    tmp_path: Path, offset: int, window: tuple[int, int], noise: float
) -> None:
    ct = head(noise)
    values = np.clip(np.asarray(ct.values), *window) + offset
    file = stored(ct, values.astype(np.int16), tmp_path / "a.nrrd")
    low = window[0]
    with pytest.raises(ValueError, match=f"cut off at {low + offset}.*--modality mr"):
        read_scan(file)
    with pytest.raises(ValueError, match="no CT numbers"):
        read_scan(file, modality=Modality.CT)
    assert read_scan(file, modality=Modality.MR).modality is Modality.MR


def test_an_mr_of_deviations_is_an_mr(tmp_path: Path) -> None:
    """Below zero, its background at one value: less the mean, by the deviation."""
    rng = np.random.default_rng(1)
    tissue = np.asarray(head(0).values) > -500
    values = np.where(tissue, 1.2 + 0.2 * rng.normal(size=tissue.shape), -0.8)
    scan = read_scan(stored(head(), values.astype(np.float32), tmp_path / "z.nii.gz"))
    assert scan.modality is Modality.MR


@pytest.mark.parametrize(("scale", "offset"), [(5.0, 0), (0.4, 600), (1.6, 2000)])
@pytest.mark.parametrize("outside", [False, True])
def test_a_cone_beam_ct_is_put_on_the_scale_and_keeps_its_bone(
    tmp_path: Path, scale: float, offset: float, outside: bool
) -> None:
    """Its grey values are no CT numbers, and differ from machine to machine."""
    ct = head(40.0)
    grey = np.rint(np.asarray(ct.values, np.float32) * scale + offset)
    if outside:
        # a cylinder is scanned; what is around it was never measured
        grey[:, :6] = grey.min() - 50
    file = stored(ct, grey.astype(np.float32), tmp_path / "a.nrrd")
    scan = read_scan(file, modality=Modality.CT)
    kept = scan.volume.values[:, 6:]
    away = np.abs(kept - np.asarray(ct.values, np.float32)[:, 6:])
    assert np.median(away) < 25
    bone = np.asarray(head(0.0).values)[:, 6:] == 900
    assert np.median(kept[bone]) == pytest.approx(900, abs=40)
    (told,) = (note for note in scan.notes if "no CT numbers" in note)
    assert "HU off" in told


@pytest.mark.parametrize(
    "name", ["scan.zip", "scan.tar.gz", "scan.TGZ", "a.7z", "b.rar"]
)
def test_archives_are_refused_by_name(tmp_path: Path, name: str) -> None:
    """Whatever is inside, nothing is unpacked: no bomb goes off."""
    (tmp_path / name).write_bytes(b"PK\x03\x04" + bytes(200))
    with pytest.raises(ValueError, match=rf"{name.replace('.', '[.]')} is an archive"):
        read_scan(tmp_path / name)


def test_a_gzip_that_unpacks_without_end_is_never_unpacked(tmp_path: Path) -> None:
    """Of 400 MB of zeros behind a small header, only what it claims is read."""
    resource = importlib.import_module("resource")
    ct = head()
    for ending in ("nii.gz", "nrrd"):
        file = stored(ct, np.asarray(ct.values), tmp_path / f"a.{ending}")
        content = file.read_bytes()
        head_end = 0 if ending == "nii.gz" else content.index(b"\n\n") + 2
        packer = zlib.compressobj(1, zlib.DEFLATED, 31)
        packed = [packer.compress(zlib.decompress(content[head_end:], 31))]
        packed += [packer.compress(bytes(1 << 24)) for _ in range(25)]
        file.write_bytes(content[:head_end] + b"".join(packed) + packer.flush())
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        assert read_scan(file).volume.shape == ct.shape
        grown_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
        assert grown_kb < 150_000


@pytest.mark.parametrize("value", [-1000, 40])
def test_a_volume_without_a_head_is_refused(tmp_path: Path, value: int) -> None:
    ct = head()
    file = stored(ct, np.full(ct.shape, value, np.int16), tmp_path / "a.nrrd")
    with pytest.raises(ValueError, match="the volume is the same everywhere"):
        read_scan(file)


@pytest.mark.parametrize("step", [3.5, 5.0])
def test_steep_voxels_are_legal(tmp_path: Path, step: float) -> None:
    """Five times as long as wide: the same numbers at the same places."""
    ct = head()
    tall = Volume(ct.values, np.array([1.0, 1.0, step]), ct.origin_mm)
    scan = read_scan(stored(tall, np.asarray(tall.values), tmp_path / "a.nrrd"))
    assert scan.volume.spacing_mm == pytest.approx([1, 1, step])
    at = tall.world_from_voxel[:3] @ np.array([20, 18, 15, 1])
    assert float(scan.volume.sample(at)) == tall.values[15, 18, 20]


def test_nothing_there(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no file or folder"):
        read_scan(tmp_path / "absent")
    with pytest.raises(ValueError, match="holds 0 files"):
        read_scan(tmp_path)
    (tmp_path / "tiny").write_bytes(b"x")
    with pytest.raises(ValueError, match="cannot be read as a volume"):
        read_scan(tmp_path / "tiny")


def test_levels_are_those_of_air_and_tissue() -> None:
    levels = Levels.of(head(30))
    assert levels.air == pytest.approx(-1000, abs=25)
    assert levels.tissue == pytest.approx(40, abs=25)


def test_sampling_keeps_a_linear_field() -> None:
    """On an oblique grid, within its own box, to float rounding."""
    angle = np.radians(20)
    turn = np.array(
        [
            [1, 0, 0],
            [0, np.cos(angle), -np.sin(angle)],
            [0, np.sin(angle), np.cos(angle)],
        ]
    )
    shape, spacing, origin = (
        (20, 24, 22),
        np.array([0.7, 0.9, 1.7]),
        np.array([1.0, 2, 3]),
    )
    k, j, i = np.meshgrid(*[np.arange(n) for n in shape], indexing="ij")
    world = np.stack([i, j, k], -1) * spacing @ turn.T + origin
    slope = np.array([3.0, -2.0, 5.0])
    tilted = Volume((world @ slope).astype(np.float32), spacing, origin, turn)
    low, high = patient_box(tilted)
    assert low == pytest.approx(world.reshape(-1, 3).min(axis=0))
    assert high == pytest.approx(world.reshape(-1, 3).max(axis=0))
    middle = tilted.center_mm
    box = isotropic(tilted, 0.5, middle - 4, middle + 4)
    assert np.array_equal(box.direction, np.eye(3))
    k, j, i = np.meshgrid(*[np.arange(n) for n in box.shape], indexing="ij")
    places = np.stack([i, j, k], -1) * 0.5 + box.origin_mm
    assert np.abs(box.values - places @ slope).max() < 1e-3


def test_a_box_beyond_memory_is_refused_first() -> None:
    with pytest.raises(ValueError, match="GiB; take a larger spacing"):
        isotropic(head(), 0.01, np.zeros(3), np.full(3, 100.0))
