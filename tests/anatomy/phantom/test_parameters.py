from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anatomy.phantom.parameters import (
    SINUSES,
    LeftRatios,
    Opacity,
    PhantomParameters,
)
from anatomy.tissue import Side


@given(st.integers(0, 2**40), st.floats(-6, 6), st.booleans())
def test_parameters_survive_json_and_keep_their_digest(
    seed: int, deviation: float, operated: bool
) -> None:
    one = PhantomParameters(
        seed=seed, septal_deviation_mm=deviation, uncinectomy=operated
    )
    again = msgspec.json.decode(msgspec.json.encode(one), type=PhantomParameters)
    assert again == one
    assert again.digest() == one.digest()


def test_every_parameter_changes_the_digest() -> None:
    plain = PhantomParameters()
    changed = [
        msgspec.structs.replace(plain, seed=2),
        msgspec.structs.replace(plain, congestion=0.5),
        msgspec.structs.replace(plain, uncinectomy=True),
        msgspec.structs.replace(plain, edge_blur_mm=0.6),
    ]
    assert len({p.digest() for p in [plain, *changed]}) == 5


@pytest.mark.parametrize(
    ("name", "value"),
    [("keros_mm", 0.5), ("seed", -1), ("congestion", float("nan")), ("seed", 2**64)],
)
def test_a_value_out_of_range_is_named(name: str, value: Any) -> None:
    with pytest.raises(ValueError, match=f"{name} must lie in"):
        PhantomParameters(**{name: value})


@pytest.mark.parametrize("keros", [13.0, -1.0])
def test_a_ratio_of_the_olfactory_fossae_out_of_range_is_named(keros: float) -> None:
    with pytest.raises(ValueError, match=r"left ratio of the olfactory fossa .* 12\]"):
        LeftRatios(keros=keros)


def test_a_fossas_depth_stays_within_what_the_model_can_carry() -> None:
    head = PhantomParameters(keros_mm=8.0, left=LeftRatios(keros=3.0))
    assert (head.keros(Side.RIGHT), head.keros(Side.LEFT)) == (8.0, 12.0)


def test_a_tiny_frontal_sinus_is_refused() -> None:
    with pytest.raises(ValueError, match="frontal_scale"):
        PhantomParameters(frontal_scale=0.2)


def test_a_side_counts_up_to_twelve() -> None:
    full = Opacity(**dict.fromkeys((*SINUSES, "ostiomeatal"), 2), polyps=4)
    assert full.total == 12
    assert Opacity(polyps=3).total == 0


@pytest.mark.parametrize(
    "scores", [{"maxillary": 3}, {"ostiomeatal": 1}, {"polyps": 5}]
)
def test_a_score_that_there_is_not_is_refused(scores: dict[str, int]) -> None:
    with pytest.raises(ValueError, match="must be one of"):
        Opacity(**scores)
