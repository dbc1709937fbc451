import numpy as np
import pytest

from anatomy.phantom.phantom import Phantom
from anatomy.phantom.synthetic_mr import magnetic_resonance
from anatomy.tissue import Label


def mean_of(values: np.ndarray, phantom: Phantom, label: Label) -> float:
    return float(values[phantom.labels.values == label].mean())


def test_the_two_weightings_order_the_tissues_as_physics_does(
    phantom: Phantom,
) -> None:
    t1, t2 = (v.values for v in magnetic_resonance(phantom))
    fat, eye = Label.FAT, Label.GLOBE
    assert mean_of(t1, phantom, fat) > mean_of(t1, phantom, Label.BRAIN)
    assert mean_of(t1, phantom, Label.BRAIN) > mean_of(t1, phantom, eye)
    assert mean_of(t2, phantom, eye) > mean_of(t2, phantom, fat)
    for volume in (t1, t2):
        assert mean_of(volume, phantom, Label.MAXILLARY_AIR) < 0.12
        assert mean_of(volume, phantom, Label.INTERNAL_CAROTID) < 0.45
        assert volume.dtype == np.float32
        assert volume.min() >= 0


def test_noise_is_rician(phantom: Phantom) -> None:
    plain = magnetic_resonance(phantom, noise=0.0)[0].values
    noisy = magnetic_resonance(phantom, noise=0.05)[0].values
    dark = plain < 1e-3
    # The mean of a Rayleigh distribution is sqrt(pi / 2) of its parameter.
    assert noisy[dark].mean() == pytest.approx(0.05 * np.sqrt(np.pi / 2), rel=0.05)


def test_an_absurd_noise_is_refused(phantom: Phantom) -> None:
    with pytest.raises(ValueError, match="MR noise"):
        magnetic_resonance(phantom, noise=-1.0)
