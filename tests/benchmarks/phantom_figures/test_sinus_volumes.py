import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom
from anatomy.phantom.variants import with_variants
from anatomy.tissue import AIR_LABELS, Label, Side
from benchmarks.phantom_figures.sinus_volumes import (
    SIDES,
    SINUSES,
    anterior_share,
    leaks,
    sinus_volumes_ml,
    spine_distances_mm,
    surface_errors_mm,
    volume_ml,
)

BOX = ((-20.0, -2.0), (14.0, 40.0), (16.0, 44.0))


@pytest.fixture(scope="module")
def coarse() -> Phantom:
    return build_phantom(PhantomParameters(), 1.2)


def with_distance(phantom: Phantom, values: NDArray[np.float32]) -> Phantom:
    volume = dataclasses.replace(phantom.distance, values=values)
    return dataclasses.replace(phantom, distance=volume)


def test_volumes_of_all_labels_make_the_whole(phantom: Phantom) -> None:
    total = sum(volume_ml(phantom, tuple(Label), side) for side in Side)
    assert total == pytest.approx(phantom.ct.values.size * phantom.spacing_mm**3 / 1000)
    air = sum(volume_ml(phantom, tuple(AIR_LABELS), side) for side in Side)
    for side in SIDES:
        assert 0 < sum(sinus_volumes_ml(phantom, side).values()) < air


def test_front_and_rear_cells_make_the_ethmoid(phantom: Phantom) -> None:
    for side in SIDES:
        front = tuple(
            label
            for label in SINUSES["ethmoid"]
            if label is not Label.POSTERIOR_ETHMOID_AIR
        )
        whole = volume_ml(phantom, SINUSES["ethmoid"], side)
        share = volume_ml(phantom, front, side) / whole
        assert anterior_share(phantom, side) == pytest.approx(share)


def test_an_open_ostium_is_named(phantom: Phantom) -> None:
    assert leaks(phantom) == []
    # A plug too small to stop the way, and one the sinus opens beside.
    tiny = {"maxillary": 0.1, "frontal": 0.1, "sphenoid": 0.1}
    named = {f"{sinus} {side}" for sinus in tiny for side in ("right", "left")}
    assert set(leaks(phantom, tiny)) == named


def test_an_accessory_ostium_is_another_way_and_no_leak() -> None:
    names = ["accessory-ostium:left"]
    head = build_phantom(with_variants(PhantomParameters(), names), 1.0)
    assert leaks(head) == []
    mark = head.landmarks.pop("accessory maxillary ostium, left")
    assert float(head.distance.sample(mark.position_mm[None])[0]) < 0
    assert leaks(head) == ["maxillary left"]


def test_a_hole_and_a_filled_sinus_are_named(phantom: Phantom) -> None:
    values = phantom.distance.values.copy()
    o, h = phantom.ct.origin_mm, phantom.spacing_mm
    x = o[0] + h * np.arange(values.shape[2])
    k, j = round((12.0 - o[2]) / h), round((28.0 - o[1]) / h)
    # A tunnel through the right medial wall below the ostium, as wide as a finger.
    values[k - 2 : k + 3, j - 2 : j + 3, (x > -24) & (x < -6)] = -1.0
    assert leaks(with_distance(phantom, values)) == ["maxillary right"]
    values = phantom.distance.values.copy()
    values[np.isin(phantom.labels.values, SINUSES["sphenoid"])] = 1.0
    filled = leaks(with_distance(phantom, values))
    assert filled == ["sphenoid right", "sphenoid left"]


def test_a_field_of_view_without_the_sinuses_is_refused() -> None:
    part = build_phantom(PhantomParameters(), 1.0, field_mm=BOX)
    with pytest.raises(ValueError, match="the whole field of view"):
        leaks(part)


def test_distances_grow_with_the_head() -> None:
    plain = spine_distances_mm(PhantomParameters())
    for name, mm in spine_distances_mm(PhantomParameters(head_scale=1.08)).items():
        assert mm == pytest.approx(1.08 * plain[name])


def test_the_surface_comes_nearer_with_the_square_of_the_voxel() -> None:
    found = []
    for spacing in (1.0, 0.5, 0.25):
        phantom = build_phantom(PhantomParameters(), spacing, field_mm=BOX)
        found.append(np.percentile(surface_errors_mm(phantom), [50, 90]))
    # Second order: a factor of 4 each time, a little less at edges and corners.
    assert np.all(found[0] > 3.0 * found[1])
    assert np.all(found[1] > 3.0 * found[2])
    # At 0.25 mm, 0.001 and 0.008 mm.
    assert found[2][1] < 0.02


def test_a_moved_surface_is_found_moved(coarse: Phantom) -> None:
    values = coarse.distance.values + np.float32(0.1)
    moved = surface_errors_mm(with_distance(coarse, values))
    assert np.median(moved) == pytest.approx(0.1, abs=0.02)
