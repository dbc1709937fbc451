import numpy as np
import pytest

from benchmarks.simulated_ranks.trace import Orbit

SMALL = Orbit(side=32, image=64)


@pytest.mark.parametrize("number", [0, 4, 11])
@pytest.mark.parametrize("thin", [1, 2, 4])
def test_a_frame_samples_the_whole_volume(number: int, thin: int) -> None:
    orbit = Orbit(side=64, image=128, spread=1.6, thin=thin)
    pixel = orbit.side * orbit.spread / orbit.image
    frame = orbit.frame(number)
    # A sample stands for the area of its pixel times one voxel along the ray.
    assert frame.samples * pixel**2 == pytest.approx(orbit.side**3, rel=0.02)
    cells = {cell for _, visited, _ in frame for cell in visited}
    assert cells == set(range(orbit.cells))


def test_a_packet_goes_from_cell_to_cell_front_to_back() -> None:
    orbit = Orbit(side=32, image=64, packet=1, thin=1, spread=1.5)
    per = orbit.side // orbit.cell
    for number in (0, 7):
        for _, cells, samples in orbit.frame(number):
            at = np.array(np.unravel_index(cells, (per,) * 3))
            steps = np.abs(np.diff(at, axis=1)).max(axis=0, initial=0)
            assert (steps <= 1).all()
            assert len(set(cells)) == len(cells) == len(samples)


def test_rays_cross_more_cells_than_packets_visit() -> None:
    frame = SMALL.frame(0)
    visits = sum(len(cells) for _, cells, _ in frame)
    assert frame.crossings > visits
    assert SMALL.cells == 64
    assert SMALL.packets == 64
