import dataclasses

import numpy as np
import pytest
from scipy import ndimage

from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom, distance_at, head_skin
from anatomy.tissue import AIR_LABELS, Label, Side
from benchmarks.phantom_figures.sinus_volumes import leaks, sinus_volumes_ml
from renderers.scene.volume import Volume
from tests.slow_cases import slow


@pytest.mark.parametrize("side", [Side.RIGHT, Side.LEFT])
def test_sinus_volumes_are_those_of_an_average_adult(
    phantom: Phantom, side: Side
) -> None:
    ml = sinus_volumes_ml(phantom, side)
    assert 11 < ml["maxillary"] < 17  # 14.3
    assert 2.0 < ml["frontal"] < 4.0  # 2.9
    assert 3.5 < ml["sphenoid"] < 5.5  # 4.7
    assert 4.0 < ml["ethmoid"] < 8.0  # 5.9


def test_structures_of_the_left_have_positive_x(phantom: Phantom) -> None:
    x = phantom.ct.origin_mm[0] + phantom.spacing_mm * np.arange(phantom.ct.shape[2])
    # The septa of sphenoid and frontal sinuses may cross the midline.
    for label in (Label.MAXILLARY_AIR, Label.GLOBE, Label.INFERIOR_TURBINATE):
        for side, sign in ((Side.LEFT, 1), (Side.RIGHT, -1)):
            inside = (phantom.labels.values == label) & (phantom.sides.values == side)
            assert np.count_nonzero(inside) > 50
            assert np.all(sign * x[np.nonzero(inside)[2]] > 0), label


def test_labels_are_air_exactly_where_the_distance_is_negative(
    phantom: Phantom,
) -> None:
    air = np.isin(phantom.labels.values, list(AIR_LABELS))
    assert np.array_equal(air, phantom.distance.values < 0)


def test_the_distance_has_the_models_sign_and_zero_set(phantom: Phantom) -> None:
    rng = np.random.default_rng(0)
    index = rng.integers(0, phantom.ct.shape, (4000, 3))
    points = phantom.ct.origin_mm + phantom.spacing_mm * index[:, ::-1]
    model = distance_at(phantom.parameters, points)
    sampled = phantom.distance.values[tuple(index.T)]
    clear = np.abs(model) > 0.1
    agreement = np.mean((model < 0)[clear] == (sampled < 0)[clear])
    assert agreement > 0.9995  # removed specks are the difference


def test_the_distance_has_unit_gradient_near_the_surface(nose: Phantom) -> None:
    d = nose.distance.values
    slope = np.linalg.norm(np.gradient(d, nose.spacing_mm), axis=0)
    # Creases and mid-surfaces of thin walls have no gradient: look from wide air.
    band = (np.abs(d) < 1.0) & (ndimage.minimum_filter(d, 7) < -1.8) & (d < 0)
    band[[0, -1]] = False
    band[:, [0, -1]] = False
    band[:, :, [0, -1]] = False
    low, middle, high = np.percentile(slope[band], [5, 50, 95])
    assert middle == pytest.approx(1.0, abs=0.03)
    assert low > 0.9
    assert high < 1.1


def test_mucosa_bone_and_air_have_their_ct_numbers(phantom: Phantom) -> None:
    hu, d = phantom.ct.values, phantom.distance.values
    assert np.all(hu[d < -3] == -1000)
    turbinate = phantom.labels.values == Label.INFERIOR_TURBINATE
    # Shared voxels pull the mean below 40 HU, the turbinate's bone above.
    assert -300 < hu[turbinate].mean() < 250
    assert phantom.bone_cover.values[d < -3].max() == 0
    assert phantom.bone_cover.values.max() == 255


def test_blood_and_skin_follow_the_anatomy(nose: Phantom) -> None:
    surface = np.abs(nose.distance.values) < 0.5
    blood = (nose.blood.values / 255.0) ** 2
    turbinate = surface & (nose.labels.values == Label.INFERIOR_TURBINATE)
    assert blood[turbinate].mean() > 0.13
    assert 0.07 < blood[surface].mean() < 0.14
    skin = nose.skin.values
    k, j, i = np.nonzero(surface)
    y = nose.ct.origin_mm[1] + nose.spacing_mm * j
    assert np.all(skin[k, j, i][y > 0] == 0)
    assert skin[k, j, i][y < -12].mean() > 200


@pytest.mark.slow
def test_sinuses_drain_through_their_ostia_and_nowhere_else() -> None:
    """With a bent septum, too; the default head in `tests/accuracy` is fast."""
    phantom = build_phantom(PhantomParameters(septal_deviation_mm=3.0), 0.7)
    pieces, count = ndimage.label(phantom.distance.values < 0)
    assert count == 1, np.bincount(pieces.ravel())[1:]
    assert leaks(phantom) == []


def test_seeds_differ_and_equal_parameters_do_not() -> None:
    box = ((-18.0, -2.0), (8.0, 50.0), (20.0, 52.0))

    def build(seed: int) -> Phantom:
        return build_phantom(PhantomParameters(seed=seed), 1.0, field_mm=box)

    first, again, other = build(4), build(4), build(5)
    for field in dataclasses.fields(Phantom):
        a, b = getattr(first, field.name), getattr(again, field.name)
        if isinstance(a, Volume):
            assert np.array_equal(a.values, b.values)
    assert not np.array_equal(first.ct.values, other.ct.values)
    septa = [p.labels.values == Label.ETHMOID_SEPTUM for p in (first, other)]
    assert np.count_nonzero(septa[0] != septa[1]) > 20


EXTREMES = [
    PhantomParameters(frontal_scale=0.0, keros_mm=12.0, congestion=1.0),
    PhantomParameters(septal_deviation_mm=-6.0, keros_mm=1.0, maxillary_scale=1.1),
    PhantomParameters(uncinectomy=True, unevenness=1.5, anterior_cells=9, seed=77),
]


@pytest.mark.parametrize("parameters", [EXTREMES[2], *slow(*EXTREMES[:2])])
def test_extreme_heads_are_finite(parameters: PhantomParameters) -> None:
    phantom = build_phantom(parameters, 2.0, threads=2)
    assert np.all(np.isfinite(phantom.distance.values))
    assert phantom.ct.values.min() >= -1000
    assert phantom.ct.values.max() < 2500


@pytest.mark.parametrize("spacing", [0.1, 4.0, float("nan")])
def test_an_impossible_spacing_is_refused(spacing: float) -> None:
    with pytest.raises(ValueError, match="spacing must lie in"):
        build_phantom(PhantomParameters(), spacing)
    with pytest.raises(ValueError, match="spacing must lie in"):
        head_skin(PhantomParameters(), spacing)


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
