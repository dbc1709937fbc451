"""Laws of the front lens: what soils it, what fogs it, and that washing cleans it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from disk import UserError
from renderers.scene import AirSurface, Volume, Wounds
from renderers.scene.lens_state import LensState
from surgery.lens import WASH_S, Lens

RADIUS = 1.35
FAR, NEAR, OUT = (15.0, 15.0, 10.0), (15.0, 15.0, 3.0), (15.0, 15.0, 90.0)


def floor(film: int = 0) -> AirSurface:
    """Air above a floor at 2 mm that bears blood, of `film` steps."""
    z = 0.5 * np.arange(40)[:, None, None]
    d = np.broadcast_to(2.0 - z, (40, 60, 60)).astype(np.float32)
    volume = Volume(d, np.full(3, 0.5), np.zeros(3), background=6.0)
    none = volume.with_values(np.zeros(d.shape, np.uint8), 0.0)
    wet = volume.with_values(np.full(d.shape, film, np.uint8), 0.0)
    return AirSurface(volume, none, none, Wounds(volume, none, none, none, wet))


def after(seconds: float, place: tuple[float, ...], film: int = 0) -> Lens:
    lens = Lens(floor(film), RADIUS)
    lens.advance(0.0, np.array(place))
    lens.advance(seconds, np.array(place))
    return lens


def test_soil_comes_by_touch_alone_and_more_by_blood() -> None:
    assert after(60.0, FAR, 50).state.soil == 0
    dry, wet = after(1.0, NEAR).state.soil, after(1.0, NEAR, 50).state.soil
    assert 0 < dry < 0.5 < wet <= 1
    assert after(1.0, NEAR, 10).state.soil < wet


def test_a_cold_lens_fogs_in_the_nose_and_clears_as_it_warms() -> None:
    fog = [after(t, FAR).state.fog for t in (0.0, 1.0, 5.0, 20.0, 90.0, 400.0)]
    assert fog[0] < fog[1] < fog[2] < fog[3]
    assert fog[3] > 0.3
    assert fog[4] < fog[3]
    assert fog[5] == 0
    assert after(100.0, OUT).state.fog == 0


def test_washing_takes_its_time_and_leaves_a_clean_lens() -> None:
    lens = after(10.0, NEAR, 50)
    assert not lens.state.is_clean
    before = lens.state
    lens.wash()
    lens.wash()
    assert lens.washes == 1
    lens.advance(10.0 + WASH_S / 2, np.array(OUT))
    assert lens.state.soil > 0
    assert lens.state.soil == pytest.approx(before.soil / 2, rel=0.05)
    lens.advance(10.0 + WASH_S + 0.05, np.array(FAR))
    assert lens.state.soil == 0
    assert lens.state.fog < 1e-3
    assert lens.state.seed != before.seed
    lens.advance(200.0, np.array(FAR))
    assert lens.state.fog < 0.05, "a warm lens with agent does not fog"


@given(
    st.lists(st.sampled_from((FAR, NEAR, OUT, "wash")), min_size=1, max_size=8),
    st.integers(1, 9),
)
def test_samples_between_change_nothing(
    stations: list[tuple[float, ...] | str], pieces: int
) -> None:
    states = []
    for parts in (1, pieces):
        lens = Lens(floor(20), RADIUS)
        lens.advance(0.0, np.array(FAR))
        place: tuple[float, ...] = FAR
        for n, station in enumerate(stations):
            if isinstance(station, str):
                lens.wash()
            else:
                place = station
            for part in range(parts):
                lens.advance(3.0 * (n + (part + 1) / parts), np.array(place))
        states.append((lens.state, lens.touches_s))
    assert states[0] == states[1]


@pytest.mark.parametrize("value", [-0.1, 1.1, float("nan")])
def test_a_state_beyond_its_range_is_refused(value: float) -> None:
    with pytest.raises(UserError, match="soil"):
        LensState(soil=value)
    with pytest.raises(UserError, match="fog"):
        LensState(fog=value)
    with pytest.raises(UserError, match="radius"):
        Lens(floor(), -value if value > 0 else value)
