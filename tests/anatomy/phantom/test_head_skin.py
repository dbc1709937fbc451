import numpy as np
import pytest

from anatomy.phantom.head_skin import head_skin
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom


def test_the_skin_is_where_the_phantom_has_it(phantom: Phantom) -> None:
    skin = head_skin(phantom.parameters, 1.5)
    # Beside the nose, where a line from the front meets skin and no nostril.
    for x in (-30.0, -20.0, 20.0, 30.0):
        for z in (10.0, 30.0, 60.0):
            depths = np.arange(-22.0, 40.0, 0.05)
            line = np.stack([np.full_like(depths, x), depths, np.full_like(depths, z)])
            entered = [
                depths[np.argmax(volume.sample(line.T) >= 0)]
                for volume in (skin, phantom.distance)
            ]
            assert entered[0] == pytest.approx(entered[1], abs=0.3)


def test_it_is_a_distance_and_bounded_by_the_room() -> None:
    skin = head_skin(PhantomParameters(), 3.0)
    d = skin.values
    assert d.dtype == np.float32
    for axis in range(3):
        assert np.all(np.take(d, [0, -1], axis=axis) < 0)
    slope = np.linalg.norm(np.gradient(d, 3.0), axis=0)
    band = (d < 0) & (d > -4.0)
    assert np.median(slope[band]) == pytest.approx(1.0, abs=0.05)
    # The nasal cavity counts as tissue.
    assert skin.sample(np.array([[6.0, 30.0, 20.0]]))[0] == pytest.approx(6.0, abs=0.1)


def test_it_grows_with_the_head_and_needs_no_number_of_threads() -> None:
    small = head_skin(PhantomParameters(), 3.0, threads=1)
    same = head_skin(PhantomParameters(), 3.0, threads=3)
    large = head_skin(PhantomParameters(head_scale=1.06), 3.0)
    assert np.array_equal(small.values, same.values)
    ratio = np.count_nonzero(large.values > 0) / np.count_nonzero(small.values > 0)
    assert ratio == pytest.approx(1.06**3, rel=0.01)


def test_an_impossible_spacing_is_refused() -> None:
    with pytest.raises(ValueError, match="spacing must lie in"):
        head_skin(PhantomParameters(), 0.1)
