"""Where the benchmarks look from, and the real scan where there is one."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.plan import UnavailableError
from benchmarks.scenes import (
    CLASSIC_QUANTITIES,
    DATA_VARIABLE,
    HEAD_CT_FILE,
    HEAD_CT_MM,
    VIEWS,
    data_folder,
    head_ct_subject,
    head_ct_volume,
    phantom_subject,
    subjects,
)
from renderers.scene import Projection, Volume


def test_the_folder_of_scans_can_be_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv(DATA_VARIABLE, raising=False)
    assert data_folder().parts[-2:] == ("shared", "data")
    monkeypatch.setenv(DATA_VARIABLE, str(tmp_path))
    assert data_folder() == tmp_path
    with pytest.raises(UnavailableError, match=HEAD_CT_FILE):
        head_ct_subject()


def test_a_scan_is_turned_upright_onto_cubes(tmp_path: Path) -> None:
    """A ramp is interpolated exactly; the first slice of the file becomes the top."""
    k, j, i = np.mgrid[:5, :4, :6]
    raw = (1024 + 30 * i + 20 * j - 15 * k).astype(np.int16)
    path = tmp_path / HEAD_CT_FILE
    np.savez(path, raw12=raw, spacing_zyx_mm=np.array([1.5, 3.0, 3.0]))
    volume = head_ct_volume(path)
    assert volume.shape == (5, 7, 11)
    assert np.all(volume.spacing_mm == HEAD_CT_MM)
    kk, jj, ii = np.mgrid[:5, :7, :11]
    wanted = 15 * ii + 10 * jj + 15 * (kk - 4)
    assert np.array_equal(volume.values, wanted)


@pytest.mark.slow
def test_inside_is_in_the_air_and_outside_is_outside() -> None:
    subject = phantom_subject(3.0)
    assert {*VIEWS} < subject.views.keys()
    assert subject.scene.surface is not None
    distance = subject.scene.surface.distance
    assert distance.sample(subject.views["inside"].eye_mm) < 0
    low = subject.scene.volume.origin_mm
    high = low + (np.array(distance.shape[::-1]) - 1) * distance.spacing_mm
    eye = subject.views["outside"].eye_mm
    assert eye[1] < low[1]
    assert np.all((eye > low)[[0, 2]] & (eye < high)[[0, 2]])


@pytest.mark.slow
def test_the_whole_head_is_in_the_outside_view() -> None:
    subject = phantom_subject(3.0)
    volume = subject.scene.volume
    camera = subject.views["outside"].camera(64, Projection.PERSPECTIVE)
    size_mm = (np.array(volume.shape[::-1]) - 1) * volume.spacing_mm
    corners = volume.origin_mm + size_mm * np.indices((2, 2, 2)).reshape(3, 8).T
    pixels, _ = camera.project(corners)
    assert np.all((pixels > 0) & (pixels < 64))


@pytest.mark.slow
def test_unlit_modes_have_no_lights() -> None:
    subject = phantom_subject(3.0)
    for quantity in CLASSIC_QUANTITIES:
        scene = subject.in_mode(quantity)
        assert isinstance(scene.volume, Volume)
        assert bool(scene.lights) == (quantity == "shaded")


def test_two_heads_are_listed_before_any_is_built() -> None:
    assert [source.name for source in subjects(quick=True)] == ["phantom", "head_ct"]


@pytest.mark.skipif(
    not (data_folder() / HEAD_CT_FILE).is_file(), reason="the real scan is not here"
)
def test_the_real_heads_inside_view_is_in_its_airway() -> None:
    subject = head_ct_subject()
    eye = subject.views["inside"].eye_mm
    assert subject.scene.volume.sample(eye) < -800
    assert subject.scene.surface is not None
    assert subject.scene.surface.distance.sample(eye) < -3
