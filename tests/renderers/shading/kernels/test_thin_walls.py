"""Slabs, walls of layers and cells behind them, by the laws of plates."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.shading.kernels.thin_walls import likeness_to_wall, slab, wall, with_cell

f32 = np.float32
RHO = st.floats(0.02, 0.9)
MM = st.floats(0.05, 5)


@given(RHO, MM, MM, st.floats(0.1, 3))
def test_two_slabs_on_each_other_are_one(
    rho: float, a: float, b: float, length: float
) -> None:
    """Stokes: T = T1 T2 / (1 - R1 R2) for any way of cutting a slab."""
    parts = []
    for thickness in (a, b, a + b):
        through, lost, _ = slab(f32(rho), f32(thickness), f32(length))
        parts.append((float(through), rho - float(lost)))
    (t1, r1), (t2, r2), (t, r) = parts
    assert t == pytest.approx(t1 * t2 / (1 - r1 * r2), rel=2e-3, abs=1e-6)
    assert r == pytest.approx(r1 + t1 * t1 * r2 / (1 - r1 * r2), rel=2e-3, abs=1e-5)


@given(RHO, MM, st.floats(0.1, 3))
def test_a_slab_gives_back_no_more_than_it_gets(
    rho: float, thickness: float, length: float
) -> None:
    through, lost, _ = slab(f32(rho), f32(thickness), f32(length))
    assert 0 <= through <= 1
    assert -1e-6 <= lost <= rho + 1e-6
    assert through + rho - lost <= 1 + 1e-6


@given(MM, RHO, st.floats(0.1, 3), RHO, st.floats(0.1, 4))
def test_a_wall_of_layers_keeps_energy_and_becomes_its_mucosa(
    thickness: float, rho: float, length: float, bone: float, bone_length: float
) -> None:
    arguments = (f32(rho), f32(length), f32(bone), f32(bone_length))
    through, back = wall(f32(thickness), *arguments)
    assert 0 <= through <= 1
    assert 0 <= back <= 1
    assert through + back <= 1 + 1e-5
    # layers of one and the same stuff are one slab of it
    same, kept = wall(f32(thickness), f32(rho), f32(length), f32(rho), f32(length))
    expected, lost, _ = slab(f32(rho), f32(thickness), f32(length))
    assert same == pytest.approx(float(expected), rel=2e-3, abs=1e-6)
    assert kept == pytest.approx(rho - float(lost), rel=2e-3, abs=1e-5)
    # mucosa of many lengths is all that is seen, whatever is beneath
    _, far = wall(f32(50), f32(rho), f32(0.05), f32(bone), f32(bone_length))
    assert far == pytest.approx(rho, rel=1e-3)


@given(st.floats(0, 1), st.floats(0, 1), RHO)
def test_a_cell_behind_gives_back_no_more_than_came_in(
    through: float, share: float, rho: float
) -> None:
    back = (1 - through) * share
    seen = with_cell(f32(through), f32(back), f32(rho))
    assert back - 1e-6 <= seen <= back + through + 1e-5
    # no wall at all is the opening of a cell: what an integrating sphere sends back
    open_ = with_cell(f32(1), f32(0), f32(rho))
    assert open_ == pytest.approx(0.25 / (1 - 0.75 * rho), rel=1e-5)


def test_faces_up_to_thirty_degrees_apart_make_a_wall_and_from_sixty_none() -> None:
    shares = []
    for degrees in range(0, 181, 5):
        angle = np.radians(degrees)
        behind = f32(np.cos(angle)), f32(np.sin(angle)), f32(0)
        shares.append(float(likeness_to_wall((f32(-1), f32(0), f32(0)), behind)))
    assert shares[:7] == pytest.approx([1.0] * 7, abs=1e-4)
    assert shares[12:] == pytest.approx([0.0] * 25, abs=1e-6)
    assert np.all(np.diff(shares) <= 0)
    assert 0 < shares[9] < 1
