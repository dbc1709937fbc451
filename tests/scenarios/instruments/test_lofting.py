import math

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.scene import Mesh
from scenarios.instruments.lofting import BentLine, eased, joined, mirrored, rod, skin

lines = st.builds(
    BentLine, st.floats(0.0, 12.0), st.floats(3.0, 60.0), st.floats(0.0, 90.0)
)


@given(lines, st.lists(st.floats(0.0, 130.0), min_size=2, max_size=20))
def test_a_line_is_measured_by_its_length(line: BentLine, at: list[float]) -> None:
    step = 1e-5
    lengths = np.array(at)
    along = (line.at(lengths + step) - line.at(lengths)) / step
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), 1.0, atol=1e-4)
    across = line.across(lengths)
    np.testing.assert_allclose(np.linalg.norm(across, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose((along * across).sum(axis=1), 0.0, atol=1e-4)


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_a_size_goes_over_evenly_and_level_at_both_ends(one: float, two: float) -> None:
    share = np.linspace(0.0, 1.0, 1001)
    way = eased(one, two, share)
    np.testing.assert_allclose(way + way[::-1], one + two, atol=1e-12)
    np.testing.assert_allclose(way[[0, -1]], (one, two), atol=1e-12)
    steps = np.diff(way) * np.sign(two - one)
    assert steps.min() >= -1e-12
    assert max(abs(steps[0]), abs(steps[-1])) <= 4e-6 * abs(two - one)


@given(lines)
def test_a_line_begins_at_the_origin_and_ends_along_z(line: BentLine) -> None:
    np.testing.assert_allclose(line.at(0.0), 0.0, atol=1e-12)
    end = line.straight_mm + line.radius_mm * math.radians(line.turn_deg)
    behind = line.at([end + 1.0, end + 6.0])
    np.testing.assert_allclose(behind[1] - behind[0], [0.0, 0.0, 5.0], atol=1e-12)
    # the tip is bent towards +y, so that the shaft lies at -y
    assert behind[0, 1] <= 1e-12


@given(lines, st.floats(0.5, 2.0), st.floats(40.0, 100.0))
def test_a_rod_has_the_volume_of_a_capsule_however_it_is_bent(
    line: BentLine, radius: float, length: float
) -> None:
    mesh = rod(line, 0.0, length, (radius, radius), sides=32)
    body = trimesh.Trimesh(mesh.vertices, mesh.faces)
    assert body.is_watertight
    polygon = 16 * math.sin(2 * math.pi / 32)
    capsule = polygon * radius**2 * (length - 2 * radius + 4 / 3 * radius)
    assert body.volume == pytest.approx(capsule, rel=0.01)


def test_surfaces_face_outwards_whichever_way_their_rings_run() -> None:
    turn = np.arange(12) * (2 * math.pi / 12)
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros(12)], axis=1)
    up = np.array([0.0, 0.0, 1.0])
    rows = np.stack([ring, ring + up, ring + 3 * up])
    for each in (rows, rows[::-1], rows[:, ::-1]):
        body = trimesh.Trimesh(*_arrays(skin(each)))
        assert body.is_watertight
        assert body.volume == pytest.approx(3 * 6 * math.sin(2 * math.pi / 12))


def test_what_is_joined_or_mirrored_keeps_its_volume() -> None:
    one = rod(BentLine(), 0.0, 10.0, (1.0, 0.5), offset_mm=3.0)
    volume = trimesh.Trimesh(*_arrays(one)).volume
    other = mirrored(one)
    assert other.vertices[:, 1].max() == -one.vertices[:, 1].min()
    both = trimesh.Trimesh(*_arrays(joined(one, other)))
    assert both.is_winding_consistent
    assert both.volume == pytest.approx(2 * volume)


def _arrays(mesh: Mesh) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    return mesh.vertices, mesh.faces
