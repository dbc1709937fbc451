from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.fsr import FuzzySet, FuzzySetRenderer, Inclusion, extract_fuzzy_set
from renderers.fsr.fuzzy_set import default_inclusion, update_fuzzy_set
from renderers.scene import Scene, TransferFunction, Volume
from tests.renderers.fsr.plain_gradients import sobel_gradient


def noise(seed: int, shape: tuple[int, int, int] = (6, 7, 9)) -> Volume:
    values = np.random.default_rng(seed).uniform(0, 100, shape).astype(np.float32)
    return Volume(values, np.array([0.5, 0.8, 1.3]), np.array([1.0, 2.0, 3.0]))


def twin(
    volume: Volume, inclusion: Inclusion
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Evaluate F at all voxels with numpy, and give the gradients."""
    table = inclusion.table.astype(np.float64)
    gradient = sobel_gradient(volume)
    magnitude = np.linalg.norm(gradient, axis=-1)
    rows, columns = table.shape
    span = inclusion.density_high - inclusion.density_low
    s = (volume.values - inclusion.density_low) / span * (columns - 1)
    s = np.clip(s, 0, columns - 1)
    g = np.minimum(magnitude / inclusion.gradient_top * (rows - 1), rows - 1)
    c = np.minimum(s.astype(int), columns - 2)
    b = np.minimum(g.astype(int), rows - 2)
    fs, fg = s - c, g - b
    low = table[b, c] * (1 - fs) + table[b, c + 1] * fs
    high = table[b + 1, c] * (1 - fs) + table[b + 1, c + 1] * fs
    return low * (1 - fg) + high * fg, gradient


def members(fuzzy: FuzzySet) -> NDArray[np.bool_]:
    mask = np.zeros(fuzzy.rows.shape, bool)
    i, j, k = fuzzy.rows.voxels().T
    mask[k, j, i] = True
    return mask


@given(seed=st.integers(0, 10**6), share=st.floats(0.05, 0.95))
def test_extraction_equals_the_plain_twin(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    volume = noise(seed)
    inclusion = Inclusion(
        rng.uniform(0, 1, (5, 8)).astype(np.float32), 10.0, 90.0, 40.0
    )
    t, gradient = twin(volume, inclusion)
    # halfway between two voxels' values, so that rounding cannot decide
    levels = np.sort(t.ravel())
    n = int(share * (len(levels) - 1))
    threshold = 0.5 * (levels[n] + levels[n + 1])
    fuzzy = extract_fuzzy_set(volume, inclusion, threshold)
    doubtful = np.abs(t - threshold) < 1e-5
    assert np.array_equal(members(fuzzy) | doubtful, (t >= threshold) | doubtful)
    i, j, k = fuzzy.rows.voxels().T
    np.testing.assert_array_equal(fuzzy.value, volume.values[k, j, i])
    np.testing.assert_allclose(fuzzy.inclusion, t[k, j, i], atol=1e-5)
    g = gradient[k, j, i].astype(np.float64)
    cosine = -(fuzzy.normals() * g).sum(-1) / np.linalg.norm(g, axis=-1)
    np.testing.assert_allclose(cosine, 1, atol=1e-6)


def test_rows_are_sorted_and_complete() -> None:
    fuzzy = extract_fuzzy_set(noise(5), Inclusion.density(0, 100), 30.0)
    rows = fuzzy.rows
    assert rows.offsets[0] == 0
    assert rows.offsets[-1] == len(fuzzy)
    for first, end in zip(rows.offsets[:-1], rows.offsets[1:], strict=True):
        assert np.all(np.diff(rows.x[first:end].astype(int)) > 0)


def test_a_set_larger_than_the_first_room_is_complete() -> None:
    volume = noise(6, (12, 40, 40))
    fuzzy = extract_fuzzy_set(volume, Inclusion.density(0, 100), -1.0)
    assert len(fuzzy) == volume.values.size


def test_integer_volumes_and_vanishing_gradients_are_taken() -> None:
    volume = Volume(np.full((4, 4, 4), 7, np.int16), np.ones(3), np.zeros(3))
    fuzzy = extract_fuzzy_set(volume, Inclusion.density(0, 10), 5.0)
    assert len(fuzzy) == 64
    assert not fuzzy.normals().any()


def test_boundary_inclusion_leaves_the_inside_out() -> None:
    k, j, i = np.indices((24, 24, 24)) - 11.5
    r = np.sqrt(i * i + j * j + k * k)
    volume = Volume((r < 9).astype(np.float32), np.ones(3), np.zeros(3))
    transfer = TransferFunction(
        np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 4.0])
    )
    shell = extract_fuzzy_set(volume, Inclusion.boundary(transfer, 1.0, 0.3), 0.5)
    solid = extract_fuzzy_set(volume, Inclusion.opacity(transfer, 1.0), 0.5)
    assert members(solid).sum() == (r < 9).sum()
    assert not members(shell)[r < 6].any()
    assert members(shell)[(r > 8) & (r < 9)].all()


def a_scene() -> Scene:
    k, j, i = np.indices((12, 12, 12)) - 5.5
    values = np.clip(4 - np.sqrt(i * i + j * j + k * k), 0, 1).astype(np.float32)
    transfer = TransferFunction(
        np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 4.0])
    )
    return Scene(Volume(values, np.ones(3), np.zeros(3)), transfer)


def test_a_scene_alone_gives_the_splats_that_the_renderer_shows() -> None:
    scene = a_scene()
    found, shown = extract_fuzzy_set(scene), FuzzySetRenderer(scene).fuzzy_set
    assert len(found) == len(shown) > 50
    np.testing.assert_array_equal(found.rows.x, shown.rows.x)
    np.testing.assert_array_equal(found.inclusion, shown.inclusion)
    less = extract_fuzzy_set(scene, threshold=0.5)
    assert 0 < len(less) < len(found)
    inclusion = default_inclusion(scene)
    assert len(extract_fuzzy_set(scene, inclusion, 0.5)) == len(less)


def test_a_volume_alone_is_told_the_right_call() -> None:
    scene = a_scene()
    inclusion = default_inclusion(scene)
    right = r"extract_fuzzy_set\(Scene\(volume, transfer_function\)\)"
    with pytest.raises(TypeError, match=f"a Volume does not say.*{right}"):
        extract_fuzzy_set(scene.volume)
    with pytest.raises(TypeError, match=right):
        extract_fuzzy_set(scene.volume, inclusion)
    with pytest.raises(TypeError, match="a ndarray does not say"):
        extract_fuzzy_set(scene.volume.values, inclusion, 0.1)  # type: ignore[arg-type]


def test_caller_mistakes_are_named() -> None:
    with pytest.raises(ValueError, match="finite"):
        extract_fuzzy_set(noise(1), Inclusion.density(0, 1), float("nan"))
    with pytest.raises(ValueError, match="empty"):
        Inclusion.density(5.0, 5.0)
    with pytest.raises(ValueError, match="at least 2"):
        Inclusion(np.zeros((1, 4), np.float32), 0.0, 1.0, 1.0)


@given(seed=st.integers(0, 10**6))
def test_an_update_equals_a_full_rebuild(seed: int) -> None:
    rng = np.random.default_rng(seed)
    before = noise(seed)
    inclusion = Inclusion(
        rng.uniform(0, 1, (5, 8)).astype(np.float32), 10.0, 90.0, 40.0
    )
    low = tuple(int(rng.integers(0, n)) for n in before.shape)
    high = tuple(
        int(rng.integers(a, n)) + 1 for a, n in zip(low, before.shape, strict=True)
    )
    values = before.values.copy()
    box = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
    values[box] = rng.uniform(0, 100, values[box].shape)
    after = before.with_values(values, 0.0)
    updated = update_fuzzy_set(
        extract_fuzzy_set(before, inclusion, 0.5), after, inclusion, 0.5,
        (low[0], low[1], low[2]), (high[0], high[1], high[2]),
    )  # fmt: skip
    rebuilt = extract_fuzzy_set(after, inclusion, 0.5)
    np.testing.assert_array_equal(updated.rows.offsets, rebuilt.rows.offsets)
    np.testing.assert_array_equal(updated.rows.x, rebuilt.rows.x)
    for name in ("octahedral", "value", "inclusion"):
        np.testing.assert_array_equal(getattr(updated, name), getattr(rebuilt, name))


@pytest.mark.parametrize(
    ("function", "complaint"),
    [
        (lambda g, d: np.full((3, 3), 1.0), r"must give \(64, 1024\), got \(3, 3\)"),
        (lambda g, d: g[:, 0], r"got \(64,\)"),
        (lambda g, d: g * np.nan + d, "must give finite numbers .* densities -1000 to"),
        (lambda g, d: np.array("x"), "must give finite numbers"),
    ],
)
def test_a_function_that_gives_no_table_is_named(
    function: Callable[..., Any], complaint: str
) -> None:
    with pytest.raises(ValueError, match=complaint):
        Inclusion.from_function(function, (-1000.0, 2000.0), 600.0)


def test_a_function_of_one_axis_or_none_is_taken() -> None:
    for function in (lambda g, d: d, lambda g, d: g, lambda g, d: np.ones(())):
        table = Inclusion.from_function(function, (0.0, 1.0), 1.0).table
        assert table.shape == (64, 1024)
        assert table.max() == 1
