import numpy as np

from anatomy.phantom.population import draw_parameters
from anatomy.tissue import Side

DRAWN = [draw_parameters(seed) for seed in range(400)]


def test_the_same_seed_draws_the_same_patient_and_another_another() -> None:
    assert draw_parameters(7) == draw_parameters(7)
    assert len({p.digest() for p in DRAWN}) == len(DRAWN)


def test_the_olfactory_fossa_has_its_published_depth() -> None:
    depth = np.array([p.keros_mm for p in DRAWN])
    assert abs(depth.mean() - 5.4) < 0.3
    # Keros I, II and III of 1200 CTs: 17.5, 74.6 and 7.9 %
    assert 0.05 < np.mean(depth < 3.5) < 0.25
    assert 0.6 < np.mean((depth >= 3.5) & (depth < 7.5)) < 0.85
    assert 0.03 < np.mean(depth >= 7.5) < 0.22


def test_the_two_olfactory_fossae_are_alike_but_not_equal() -> None:
    depth = np.array([[p.keros(s) for s in (Side.RIGHT, Side.LEFT)] for p in DRAWN])
    assert np.abs(depth.mean(axis=0) - 5.4).max() < 0.3
    assert np.abs(depth.std(axis=0) - 1.7).max() < 0.3
    assert 0.75 < np.corrcoef(depth.T)[0, 1] < 0.92


def test_two_of_three_septa_deviate_to_either_side() -> None:
    bend = np.array([p.septal_deviation_mm for p in DRAWN])
    assert 0.6 < np.mean(np.abs(bend) > 1.2) < 0.8
    assert 0.4 < np.mean(bend > 0) < 0.6


def test_sinuses_of_the_two_sides_are_alike_but_not_equal() -> None:
    sizes = np.array(
        [
            [p.scale("maxillary", side) for side in (Side.RIGHT, Side.LEFT)]
            for p in DRAWN
        ]
    )
    assert 0.45 < np.corrcoef(sizes.T)[0, 1] < 0.75
