import pytest

from anatomy.phantom.sinus_opacity import Opacity


def test_a_side_counts_up_to_twelve() -> None:
    full = Opacity(
        maxillary=2,
        anterior_ethmoid=2,
        posterior_ethmoid=2,
        sphenoid=2,
        frontal=2,
        ostiomeatal=2,
        polyps=4,
    )
    assert full.total == 12
    assert Opacity(polyps=3).total == 0


@pytest.mark.parametrize(
    "scores", [{"maxillary": 3}, {"ostiomeatal": 1}, {"polyps": 5}]
)
def test_a_score_that_there_is_not_is_refused(scores: dict[str, int]) -> None:
    with pytest.raises(ValueError, match="must be one of"):
        Opacity(**scores)
