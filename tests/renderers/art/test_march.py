import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.art.kernel_set import scalar_kernels
from renderers.art.march import ClassicMarch, ScopeMarch, clear_intervals
from renderers.art.quality import Quality
from renderers.scene import Scene, TransferFunction, Volume

F = np.float32


@given(
    kappa=st.lists(st.sampled_from([0.0, 0.5]), min_size=2, max_size=7),
    low=st.floats(-20, 90, width=16),
    width=st.floats(0, 40, width=16),
)
def test_clear_intervals_agree_with_the_transfer_function(
    kappa: list[float], low: float, width: float
) -> None:
    n = len(kappa)
    transfer = TransferFunction(
        np.arange(0.0, 10.0 * n, 10.0), np.zeros((n, 3)), np.array(kappa)
    )
    high = low + width
    inside = any(a <= low and high <= b for a, b in clear_intervals(transfer))
    assert inside == transfer.is_clear(low, high)


def test_classification_holds_the_users_own_nodes(scene: Scene) -> None:
    """A jump of .01 HU stays where it is, wherever the bins begin."""
    march = ClassicMarch(scene, Quality(0.5, 0.0), (-1000.0, 1000.0), scalar_kernels())
    table = march.table
    for density in (-400.0, -150.0, 99.99, 100.0, 100.005, 100.01, 299.0, 300.0, 1e4):
        k = table.bins[
            int(np.clip((F(density) - table.low) * table.scale, 0, len(table.bins) - 1))
        ]
        while F(density) >= table.extinction[k, 1]:
            k += 1
        assert F(density) >= table.extinction[k, 0] or k == 0
        dv = max(F(density) - table.extinction[k, 0], F(0))
        color, kappa = scene.transfer_function.evaluate(np.array([F(density)]))
        found = table.color[k] + dv * table.color_slope[k]
        found[3] = table.extinction[k, 2] + dv * table.extinction[k, 3]
        assert found == pytest.approx([*color[0], kappa[0]], abs=5e-5)


def test_the_scope_needs_a_surface(scene: Scene) -> None:
    bare = Scene(scene.volume, scene.transfer_function)
    with pytest.raises(ValueError, match="no air surface"):
        ScopeMarch(bare, Quality(0.5, 0.0), scalar_kernels())


def test_too_many_samples_are_refused(scene: Scene) -> None:
    long = Volume(
        np.zeros((2, 2, 40_000), np.int16), np.array([1.0, 1, 1]), np.zeros(3)
    )
    with pytest.raises(ValueError, match="choose a larger one"):
        ClassicMarch(
            Scene(long, scene.transfer_function),
            Quality(1 / 256, 0),
            (0, 1),
            scalar_kernels(),
        )
