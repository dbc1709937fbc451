import itertools

import pytest

from renderers.art.quality import QUALITIES, Quality


def test_names_go_from_coarse_to_fine() -> None:
    qualities = [Quality.named(name) for name in QUALITIES]
    assert list(QUALITIES) == ["preview", "snapshot", "final", "reference"]
    for coarse, fine in itertools.pairwise(qualities):
        assert fine.step_voxels < coarse.step_voxels
        assert fine.cutoff < coarse.cutoff


@pytest.mark.parametrize("name", ["final", "reference"])
def test_the_best_are_never_renormalised(name: str) -> None:
    assert not Quality.named(name).renormalise
    assert Quality.named(name).cutoff <= 1e-4


@pytest.mark.parametrize(
    ("step", "cutoff"), [(0.0, 0.1), (-1, 0.1), (5, 0.1), (float("nan"), 0), (1, 0.5)]
)
def test_nonsense_is_refused(step: float, cutoff: float) -> None:
    with pytest.raises(ValueError, match="must be"):
        Quality(step, cutoff)


def test_an_unknown_name_lists_the_known() -> None:
    with pytest.raises(ValueError, match="preview, snapshot, final, reference"):
        Quality.named("ultra")
