"""What is written is read back by the libraries that others use, bit for bit."""

from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
import SimpleITK
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from paravol.snapshots.picture_files import save_depth_nrrd, save_exr

H, W = 5, 7


Picture = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint32]]


def picture() -> Picture:
    rng = np.random.default_rng(0)
    # far beyond what a screen shows, and the smallest there is
    rgba = (10.0 ** rng.uniform(-44, 6, (H, W, 4))).astype(np.float32)
    depth = rng.uniform(0.1, 90, (H, W)).astype(np.float32)
    depth[2, 3] = np.inf
    return rgba, depth, rng.integers(0, 2**32, (H, W), dtype=np.uint32)


def test_exr_keeps_every_bit(tmp_path: Path) -> None:
    rgba, depth, samples = picture()
    path = tmp_path / "out" / "a.exr"
    text = {"comments": "Größe µm", "camera": '{"eye_mm": [1, 2, 3]}'}
    save_exr(path, rgba, depth_mm=depth, samples=samples, text=text)
    with OpenEXR.File(str(path)) as file:
        channels = file.channels()
        assert_array_equal(channels["RGBA"].pixels, rgba)
        assert_array_equal(channels["Z"].pixels, depth)
        assert_array_equal(channels["samples"].pixels, samples)
        assert {key: file.header()[key] for key in text} == text
    assert [p.name for p in path.parent.iterdir()] == ["a.exr"]


def test_exr_holds_what_it_is_given(tmp_path: Path) -> None:
    rgba, _, _ = picture()
    save_exr(tmp_path / "a.exr", rgba[::-1, ::2])
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        assert set(file.channels()) == {"RGBA"}
        assert_array_equal(file.channels()["RGBA"].pixels, rgba[::-1, ::2])


def test_depth_is_a_nrrd_that_others_read(tmp_path: Path) -> None:
    _, depth, _ = picture()
    save_depth_nrrd(tmp_path / "a.nrrd", depth, {"unit": "mm along the ray"})
    image: Any = SimpleITK.ReadImage(str(tmp_path / "a.nrrd"))
    assert_array_equal(SimpleITK.GetArrayFromImage(image), depth)
    assert image.GetMetaData("unit") == "mm along the ray"


def test_wrong_pictures_are_refused_and_leave_nothing(tmp_path: Path) -> None:
    rgba, depth, samples = picture()
    path = tmp_path / "a.exr"
    doubled: Any = depth.astype(np.float64)
    with pytest.raises(ValueError, match=r"\(h, w, 4\) float32, got \(5, 7, 3\)"):
        save_exr(path, rgba[..., :3])
    with pytest.raises(ValueError, match=r"channel Z must be float32 .*float64"):
        save_exr(path, rgba, depth_mm=doubled)
    with pytest.raises(ValueError, match=r"channel samples .*got uint32 \(5, 6\)"):
        save_exr(path, rgba, samples=samples[:, 1:])
    with pytest.raises(ValueError, match=r"\(h, w\) float32, got \(35,\)"):
        save_depth_nrrd(tmp_path / "a.nrrd", depth.reshape(-1))
    assert not list(tmp_path.iterdir())
