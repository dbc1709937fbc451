"""Laws of the front lens: what soils it, what fogs it, and that washing cleans it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.scene import AirSurface, Volume, Wounds
from renderers.scene.lens_state import CLEAN, LensState, all_over
from surgery.lens import WASH_S, Lens
from system import UserError

RADIUS = 1.35
FAR, NEAR, OUT = (15.0, 15.0, 10.0), (15.0, 15.0, 1.8), (15.0, 15.0, 90.0)
DOWN = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, -1]])
"""Right, up and the way of the shaft of a scope that looks at the floor."""
ALONG = np.array([[1.0, 0, 0], [0, 0, 1], [0, 1, 0]])
"""Of one that looks along the floor, which lies below it."""
SIDE = np.array([[1.0, 0, 0], [0, 0.5, 0.75**0.5], [0, 0.75**0.5, -0.5]])
"""Of one that meets the floor slantwise, with the lower part of its rim."""


def floor(film: int = 0, skin: int = 0) -> AirSurface:
    """Air above a floor at 2 mm that bears blood, of `film` steps, and is skin."""
    z = 0.5 * np.arange(40)[:, None, None]
    d = np.broadcast_to(2.0 - z, (40, 60, 60)).astype(np.float32)
    volume = Volume(d, np.full(3, 0.5), np.zeros(3), background=6.0)
    none = volume.with_values(np.zeros(d.shape, np.uint8), 0.0)
    wet = volume.with_values(np.full(d.shape, film, np.uint8), 0.0)
    dry = volume.with_values(np.full(d.shape, skin, np.uint8), 0.0)
    return AirSurface(volume, none, dry, Wounds(volume, none, none, none, wet))


def framed(
    place: tuple[float, ...], axes: NDArray[np.float64] = DOWN
) -> NDArray[np.float64]:
    return np.vstack([place, axes])


def after(
    seconds: float,
    place: tuple[float, ...],
    film: int = 0,
    *,
    newton: float = 0.5,
    skin: int = 0,
    axes: NDArray[np.float64] = DOWN,
) -> Lens:
    lens = Lens(floor(film, skin), RADIUS)
    lens.advance(0.0, framed(place, axes), newton)
    lens.advance(seconds, framed(place, axes), newton)
    return lens


def test_skin_soils_nearly_nothing() -> None:
    assert after(2.0, NEAR, newton=0.1, skin=255).state.soil < 0.01
    assert after(2.0, NEAR, newton=0.1).state.soil > 0.05


def test_mucosa_smears_in_proportion_to_force_and_time() -> None:
    assert after(60.0, FAR, 50).state.soil == 0
    assert after(9.0, NEAR, newton=0.0).state.soil == 0.0
    light = after(0.1, NEAR, newton=0.05).state
    assert light.blood == CLEAN.blood
    for times, newton in ((1, 0.1), (2, 0.05)):
        more = after(0.1 * times, NEAR, newton=newton).state
        assert more.soil == pytest.approx(2 * light.soil, rel=0.02)
    areas = [after(1.0, NEAR, newton=n).state.soil for n in (0.1, 0.5, 2.5, 12.5)]
    assert areas == sorted(areas)
    assert areas[0] < 0.15 < 0.9 < areas[-1]


def test_only_what_is_touched_gets_dirty() -> None:
    """A scope that leans on the floor with its lower rim, and one that slides on it."""
    for film in (0, 10):
        state = after(5.0, (15.0, 15.0, 2.6), film, newton=1.0, axes=SIDE).state
        soil = state.blood if film else state.mucus
        assert soil[6] > 0.3, "below"
        assert soil[2] == soil[1] == soil[3] == 0.0, "above"
        assert state.soil < 0.5
    slid = after(5.0, (15.0, 15.0, 2.0 + RADIUS), newton=1.0, axes=ALONG).state
    assert slid.soil == 0.0


def test_blood_comes_where_blood_is_and_the_more_the_thicker() -> None:
    dry, thin, thick = (
        after(0.3, NEAR, film, newton=0.02).state.blood for film in (0, 10, 50)
    )
    assert dry == CLEAN.blood
    assert 0 < max(thin) < 0.5 * max(thick)
    assert after(0.3, NEAR, 50, newton=0.02, skin=255).state.blood == thick


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
    lens.advance(10.0 + WASH_S / 2, framed(OUT), 0.0)
    assert lens.state.soil > 0
    assert lens.state.soil == pytest.approx(before.soil / 2, rel=0.05)
    lens.advance(10.0 + WASH_S + 0.05, framed(FAR), 0.0)
    assert lens.state.soil == 0
    assert lens.state.fog < 1e-3
    assert lens.state.seed != before.seed
    assert lens.state.drops > 0.9, "water is left"
    lens.advance(200.0, framed(FAR), 0.0)
    assert lens.state.drops == 0
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
        lens.advance(0.0, framed(FAR), 0.3)
        place: tuple[float, ...] = FAR
        for n, station in enumerate(stations):
            if isinstance(station, str):
                lens.wash()
            else:
                place = station
            for part in range(parts):
                lens.advance(3.0 * (n + (part + 1) / parts), framed(place), 0.3)
        states.append((lens.state, lens.touches_s))
    assert states[0] == states[1]


@pytest.mark.parametrize("value", [-0.1, 1.1, float("nan")])
def test_a_state_beyond_its_range_is_refused(value: float) -> None:
    for name in ("blood", "mucus"):
        with pytest.raises(UserError, match=name):
            LensState(**{name: all_over(value)})  # type: ignore[arg-type]
    for name in ("fog", "drops"):
        with pytest.raises(UserError, match=name):
            LensState(**{name: value})  # type: ignore[arg-type]
    with pytest.raises(UserError, match="radius"):
        Lens(floor(), -value if value > 0 else value)
