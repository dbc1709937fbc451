import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.art.classification import classification, clear_intervals
from renderers.art.kernels.march_types import Classification
from renderers.scene import TransferFunction

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


def classified(table: Classification, v: np.float32) -> list[float]:
    """Give colour and extinction as the kernels look them up."""
    place = np.clip((v - table.low) * table.scale + F(1), F(0), table.last)
    line, f = table.lines[int(place)], place - F(int(place))
    if line[0] >= 0:
        return [float(line[k] + f * line[k + 1]) for k in (2, 4, 6, 0)]
    k = table.first[int(place)]
    while v >= table.extinction[k, 1]:
        k += 1
    # A place is rounded: the segment may begin a hair after the value, and is level
    # before its beginning.
    hair = np.spacing(F(table.last)) / table.scale
    assert v >= table.extinction[k, 0] - hair or k == 0
    dv = max(v - table.extinction[k, 0], F(0))
    color = table.color[k, :3] + dv * table.color_slope[k, :3]
    return [
        *color.tolist(),
        float(table.extinction[k, 2] + dv * table.extinction[k, 3]),
    ]


@given(
    nodes=st.lists(st.integers(-3000, 3000), min_size=2, max_size=9, unique=True),
    part=st.sampled_from([1.0, 0.5, 0.3, 1e-3]),
    seed=st.integers(0, 999),
)
def test_bins_never_differ_from_the_nodes(
    nodes: list[int], part: float, seed: int
) -> None:
    """At nodes, just beside them, and anywhere; jumps as steep as float32 allows."""
    rng = np.random.default_rng(seed)
    at = np.sort(np.array(nodes)) * part
    kappa = rng.uniform(0, 2, len(at)) * rng.integers(0, 2, len(at))
    transfer = TransferFunction(at, rng.uniform(0, 1, (len(at), 3)), kappa)
    table = classification(transfer)
    near = np.concatenate([np.nextafter(F(at), F(s)) for s in (-np.inf, np.inf)])
    tried = np.concatenate([F(at), near, rng.uniform(at[0] - 9, at[-1] + 9, 40)])
    steepest = np.abs(np.diff(kappa) / np.diff(at)).max()
    for density in tried.astype(np.float32):
        found = classified(table, density)
        color, extinction = transfer.evaluate(np.array([density]))
        slack = (
            4e-7 * (np.abs(at).max() + 1) * (steepest + 1 / np.diff(at).min()) + 1e-6
        )
        assert found == pytest.approx([*color[0], extinction[0]], abs=slack)
        if transfer.is_clear(float(density), float(density)):
            assert found[3] == 0
