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


def test_counting_and_sorting_find_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    counted = [(n, c, s.tolist()) for n, c, s in SMALL.frame(2)]
    monkeypatch.setattr("benchmarks.simulated_ranks.trace._MOST_BINS", 0)
    assert [(n, c, s.tolist()) for n, c, s in SMALL.frame(2)] == counted


def test_rays_cross_more_cells_than_packets_visit() -> None:
    frame = SMALL.frame(0)
    visits = sum(len(cells) for _, cells, _ in frame)
    assert frame.crossings > visits
    assert SMALL.cells == 64
    assert SMALL.packets == 64


@pytest.mark.parametrize("thin", [1, 2])
def test_strands_are_the_rays_of_the_packets(thin: int) -> None:
    orbit = Orbit(side=32, image=64, thin=thin)
    frame = orbit.frame(3)
    packets = {n: dict(zip(c, s.tolist(), strict=True)) for n, c, s in frame}
    crossings = 0
    for number, strands in orbit.strands(3):
        whole: dict[int, float] = {}
        for cells, numbers in strands.items():
            rays = int(numbers[-1])
            crossings += rays * len(cells)
            for cell, samples in zip(cells, numbers[:-1].tolist(), strict=True):
                whole[cell] = whole.get(cell, 0) + samples
        found = packets.pop(number)
        assert whole.keys() == found.keys()
        # Half a sample is rounded down there.
        assert all(int(whole[cell]) == found[cell] for cell in found)
    assert not packets
    assert crossings == frame.crossings
