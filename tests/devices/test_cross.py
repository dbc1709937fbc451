import numpy as np

from devices.cross import cross


def test_it_has_the_bits_of_numpys() -> None:
    for a, b in np.random.default_rng(1).normal(size=(200, 2, 3)):
        assert cross(a, b).tobytes() == np.cross(a, b).tobytes()
