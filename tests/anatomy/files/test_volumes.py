import resource
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from anatomy.files.volumes import load_volume, save_volume
from renderers.scene.volume import Volume


def oblique() -> Volume:
    values = np.random.default_rng(0).integers(-1000, 2000, (5, 6, 7)).astype(np.int16)
    a, b = np.radians(20), np.radians(-35)
    turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    tilt = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    return Volume(
        values, np.array([0.5, 0.75, 2.0]), np.array([-40.0, 11, 3]), turn @ tilt
    )


@pytest.mark.parametrize(
    ("ending", "tolerance"), [("nrrd", 1e-9), ("mha", 1e-5), ("nii.gz", 1e-4)]
)
def test_orientation_survives(tmp_path: Path, ending: str, tolerance: float) -> None:
    volume = oblique()
    path = tmp_path / f"head.{ending}"
    save_volume(volume, path)
    again = load_volume(path)
    assert np.array_equal(again.values, volume.values)
    assert again.world_from_voxel == pytest.approx(
        volume.world_from_voxel, abs=tolerance
    )
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_what_is_no_volume_is_refused_by_name(tmp_path: Path) -> None:
    noise = tmp_path / "noise.nrrd"
    noise.write_bytes(b"NRRD0004\nnot a header")
    text = tmp_path / "notes.txt"
    text.write_text("hello")
    for path in (noise, text):
        with pytest.raises(ValueError, match=f"{path.name} cannot be read"):
            load_volume(path)
    with pytest.raises(ValueError, match=r"no volume file .*absent\.nrrd"):
        load_volume(tmp_path / "absent.nrrd")


BOMB = bytes.fromhex(
    "0800dd0055491400312e322e3834302e313018000000000000003232000808004353100044455249"
    "5645443333200065914154040062000b00200067914154040062000a00200021944c4f1a00526566"
    "6572656e636564205365676d656e74204e756d62657220feff00e07e000000200064ffffffffffff"
    "ff022e3832362e302e312e333638303034332e31302e363300316363636363636363636363636363"
    "63002ee0"
)
"""Found by the fuzzer: SimpleITK takes 2 GB to see that this is no DICOM file."""


def refused_with_mib(path: Path) -> int:
    with pytest.raises(ValueError, match="cannot be read"):
        load_volume(path)
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024


def test_what_is_no_volume_takes_no_memory(tmp_path: Path) -> None:
    sizes = []
    for name, content in (("notes.txt", b"hello"), ("labels.dcm", BOMB)):
        (tmp_path / name).write_bytes(content)
        with ProcessPoolExecutor(1, get_context("spawn")) as process:
            sizes.append(process.submit(refused_with_mib, tmp_path / name).result())
    assert sizes[1] < sizes[0] + 200


def test_flat_and_coloured_images_are_refused(tmp_path: Path) -> None:
    sitk = pytest.importorskip("SimpleITK")
    flat = tmp_path / "flat.nrrd"
    sitk.WriteImage(sitk.GetImageFromArray(np.zeros((4, 5), np.int16)), str(flat))
    colour = tmp_path / "colour.nrrd"
    image = sitk.GetImageFromArray(np.zeros((4, 5, 6, 3), np.uint8), isVector=True)
    sitk.WriteImage(image, str(colour))
    for path in (flat, colour):
        with pytest.raises(ValueError, match=path.name):
            load_volume(path)


def test_a_name_without_a_format_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="cannot be written"):
        save_volume(oblique(), tmp_path / "head.unknown")
    assert not list(tmp_path.iterdir())
