import dataclasses

import numpy as np
import pytest

from anatomy.phantom.phantom import Phantom
from benchmarks.phantom_figures.wall_peaks import septa_head, septum_peaks


@pytest.fixture(scope="module")
def ethmoid() -> Phantom:
    return septa_head()


def with_ct(phantom: Phantom, values: np.ndarray) -> Phantom:
    return dataclasses.replace(
        phantom, ct=dataclasses.replace(phantom.ct, values=values)
    )


def test_a_plate_of_known_height_is_its_own_peak(ethmoid: Phantom) -> None:
    values = np.full_like(ethmoid.ct.values, -1000)
    values[:, 40::8] = -300
    found = septum_peaks(with_ct(ethmoid, values))
    assert len(found) > 300
    assert np.all(found == -300)


def test_peaks_follow_the_contrast_and_air_has_none(ethmoid: Phantom) -> None:
    plain = septum_peaks(ethmoid)
    hu = ethmoid.ct.values.astype(float)
    # Half the contrast to air: a peak below 100 HU is no peak any more.
    half = septum_peaks(with_ct(ethmoid, (hu - 1000) / 2))
    assert 0 < len(half) < len(plain)
    assert np.median(half) == pytest.approx((np.median(plain) - 1000) / 2, abs=40)
    flat = np.full_like(hu, -1000)
    assert len(septum_peaks(with_ct(ethmoid, flat))) == 0
