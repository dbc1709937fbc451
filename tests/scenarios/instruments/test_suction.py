import numpy as np
import pytest
import trimesh

from scenarios.instruments import suction_tube


def test_tube_has_the_bits_of_a_general_revolution() -> None:
    """Recordings of it were drawn from a mesh that trimesh had made."""
    mesh = suction_tube(bend_deg=0.0)
    angles = np.linspace(0.0, np.pi, 9)
    lip = np.stack([1.0 + 0.2 * np.cos(angles), 0.2 - 0.2 * np.sin(angles)], axis=1)
    back = np.linspace(70.0, 130.0, 24)
    outside = np.stack([np.full(24, 1.2), back], axis=1)[::-1]
    inside = np.stack([np.full(24, 0.8), back], axis=1)
    profile = np.concatenate([outside, lip, inside, outside[:1]])
    tube = trimesh.creation.revolve(profile, sections=32)
    tube.fix_normals()
    np.testing.assert_allclose(mesh.vertices, tube.vertices, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(mesh.faces, tube.faces)


def test_volume_is_that_of_the_wall() -> None:
    mesh = suction_tube(outer_mm=3.0, bore_mm=2.0, length_mm=100.0, bend_deg=0.0)
    body = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)
    n = 32
    polygon = n / 2 * np.sin(2 * np.pi / n)  # area of the 32-gon in a unit circle
    wall = polygon * (1.5**2 - 1.0**2) * 100.0
    # the half-round rim takes off a little
    assert body.volume == pytest.approx(wall, rel=5e-3)


def test_tip_is_at_the_origin_and_the_shaft_along_z() -> None:
    mesh = suction_tube(outer_mm=2.4, bend_start_mm=70.0)
    straight = mesh.vertices[mesh.vertices[:, 2] < 70.0]
    assert mesh.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-9)
    assert np.hypot(straight[:, 0], straight[:, 1]).max() == pytest.approx(1.2)


def test_bend_keeps_the_tube_round() -> None:
    mesh = suction_tube(bend_deg=40.0, length_mm=120.0, bend_start_mm=70.0)
    end_turn = np.radians(40.0)
    axis = np.array([0.0, np.sin(end_turn), np.cos(end_turn)])
    radius = 50.0 / end_turn
    center = np.array(
        [0.0, radius * (1 - np.cos(end_turn)), 70 + radius * np.sin(end_turn)]
    )
    on_end = np.abs((mesh.vertices - center) @ axis) < 1e-6
    assert on_end.sum() >= 64
    distance = np.linalg.norm(mesh.vertices[on_end] - center, axis=1)
    assert set(np.round(distance, 6)) == {0.8, 1.2}


@pytest.mark.parametrize(("outer", "bore"), [(2.0, 2.0), (2.0, 0.0), (1.0, 3.0)])
def test_impossible_tubes_are_refused(outer: float, bore: float) -> None:
    with pytest.raises(ValueError, match="bore"):
        suction_tube(outer_mm=outer, bore_mm=bore)
