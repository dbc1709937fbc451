"""What is told of scans that were made worse by a known amount."""

import math

import numpy as np
import pytest

from anatomy.phantom.phantom import Phantom
from anatomy.scan.imported import import_head
from anatomy.scan.scan import Modality, Scan
from anatomy.scan.scan_quality import noise_hu, scan_quality, thinnest_wall_mm
from renderers.scene.volume import Volume


@pytest.mark.parametrize("noise", [5.0, 20.0, 80.0])
def test_noise_is_told(noise: float) -> None:
    """Over steps of fat, muscle and bone, which are no noise."""
    rng = np.random.default_rng(3)
    ct = np.full((12, 96, 96), 50.0)
    ct[:, 20:40] = -90.0
    ct[:, :, 60:70] = 1100.0
    ct[:, 80:, :20] = -1000.0
    ct += noise * rng.normal(size=ct.shape)
    volume = Volume(np.rint(ct).astype(np.int16), np.ones(3), np.zeros(3))
    assert noise_hu(volume) == pytest.approx(noise, rel=0.1)


def test_without_soft_tissue_no_noise_is_told() -> None:
    bone = Volume(np.full((9, 32, 32), 900, np.int16), np.ones(3), np.zeros(3))
    assert noise_hu(bone) is None


def test_the_thinnest_wall_is_half_as_dense_as_it_is() -> None:
    """By the blurred box's own closed form, at its middle."""
    for blur in (0.3, 0.8):
        wall = thinnest_wall_mm(blur)
        assert math.erf(wall / (2 * math.sqrt(2) * blur)) == pytest.approx(
            0.5, abs=1e-3
        )
    along = thinnest_wall_mm(0.3, 4.0)
    assert along == pytest.approx(1.349 * math.hypot(0.3, 4 / math.sqrt(12)))


def told(scan: Scan) -> dict[str, tuple[float, str]]:
    found = scan_quality(scan, import_head(scan, 1.0))
    return {f.name: (f.value, f.limits) for f in found}


def test_what_was_cut_is_told(phantom: Phantom) -> None:
    whole = Scan(phantom.ct, Modality.CT, ())
    good = told(whole)
    assert not good.keys() & {"face", "nasal floor", "clipping", "lost slices"}
    ct = phantom.ct
    values = np.asarray(ct.values)
    top = round((40.0 - float(ct.origin_mm[2])) / phantom.spacing_mm)
    low = Volume(np.minimum(values[:top], 600), ct.spacing_mm, ct.origin_mm)
    scan = Scan(low, Modality.CT, (), step_mm=4.0, tilt_deg=18.5, lost_slices=3)
    bad = told(scan)
    assert bad["clipping"][0] == 600
    assert bad["lost slices"][0] == 3
    assert bad["gantry tilt"][0] == 18.5
    assert bad["slice step"][0] == 4.0
    assert "may be open where there is bone" in bad["slice step"][1]
    assert {"skull base", "frontal sinuses"} <= bad.keys()
    assert "face" not in bad


def test_a_cut_face_and_floor_are_told(phantom: Phantom) -> None:
    ct = phantom.ct
    front, floor = (
        round((at - float(ct.origin_mm[axis])) / phantom.spacing_mm)
        for at, axis in ((0.0, 1), (8.0, 2))
    )
    values = np.asarray(ct.values)[floor:, front:]
    origin = ct.origin_mm + phantom.spacing_mm * np.array([0.0, front, floor])
    bad = told(Scan(Volume(values, ct.spacing_mm, origin), Modality.CT, ()))
    assert {"face", "nasal floor"} <= bad.keys()
