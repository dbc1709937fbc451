from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike

from scenarios.endoscope import Endoscope
from scenarios.metrics import Measured
from scenarios.metrics.metric import Found
from scenarios.metrics.scope_view import (
    SCOPE_VIEW,
    Views,
    horizon_error_deg,
    tool_in_view,
)
from tests.scenarios.metrics.tracks import of_scope, track

TIMES = np.arange(0.0, 10.0, 0.01)
HERE = np.zeros((len(TIMES), 3))


def value(name: str, measured: Measured, target: str = "") -> Found:
    (definition,) = (d for d in SCOPE_VIEW if d.name == name)
    return definition.answers(measured)[f"{name}: {target}" if target else name]


def looking(pointing: ArrayLike, at: tuple[float, float, float]) -> Measured:
    return of_scope(track(TIMES, HERE, pointing), targets={"ostium": np.array(at)})


@pytest.mark.parametrize("turn_deg", [0.0, 7.0, -30.0, 90.0, 179.0])
def test_the_horizon_error_is_the_pictures_turn(turn_deg: float) -> None:
    turn = np.radians(turn_deg)
    forward, right, up = np.eye(3)[[1, 0, 2]]
    turned = Views(
        forward[None],
        (np.cos(turn) * right + np.sin(turn) * up)[None],
        (np.cos(turn) * up - np.sin(turn) * right)[None],
    )
    error, share = horizon_error_deg(turned)
    assert error[0] == pytest.approx(abs(turn_deg))
    assert share[0] == pytest.approx(1.0)


def test_looking_up_there_is_no_horizon() -> None:
    straight_up = Views(*(np.eye(3)[[k]] for k in (2, 0, 1)))
    error, share = horizon_error_deg(straight_up)
    assert np.isnan(error[0])
    assert share[0] == 0.0


def test_a_camera_head_that_is_held_upright_has_no_error() -> None:
    assert value("horizon error", looking((0.3, 1.0, 0.4), (0, 9, 0))).value == (
        pytest.approx(0.0, abs=1e-9)
    )


@pytest.mark.parametrize("turn_deg", [-150.0, -20.0, 0.0, 35.0])
def test_a_turned_camera_head_is_the_horizons_error(turn_deg: float) -> None:
    upright = looking((0.3, 1.0, 0.4), (0, 9, 0))
    camera_deg = np.full(len(TIMES), turn_deg)
    scope = replace(upright.scope, camera_deg=camera_deg)
    found = value("horizon error", replace(upright, scope=scope)).value
    assert found == pytest.approx(abs(turn_deg), abs=1e-6)


def test_a_camera_head_that_turns_past_180_degrees_has_no_jump() -> None:
    """From 170 to 190 degrees evenly: the error is 180 less |turn - 180|."""
    upright = looking((0.0, 1.0, 0.0), (0, 9, 0))
    camera_deg = np.linspace(170.0, 190.0, len(TIMES))
    wrapped = (camera_deg + 180.0) % 360.0 - 180.0
    scope = replace(upright.scope, camera_deg=wrapped)
    found = value("horizon error", replace(upright, scope=scope)).value
    assert found == pytest.approx(175.0, abs=0.05)


@pytest.mark.parametrize(("angle_deg", "is_centred"), [(0, 1), (10, 1), (20, 0)])
def test_centring_is_an_angle_and_a_cone(angle_deg: float, is_centred: float) -> None:
    angle = np.radians(angle_deg)
    measured = looking((0.0, 1.0, 0.0), (10 * np.sin(angle), 10 * np.cos(angle), 0.0))
    off = value("angle off axis", measured, "ostium").value
    assert off == pytest.approx(angle_deg, abs=1e-5)
    assert value("centred share", measured, "ostium").value == is_centred


def test_an_angled_scope_centres_what_lies_aside() -> None:
    """Its light post is upwards: 30 degrees up of the shaft is its middle."""
    at = 10 * np.array([0.0, np.cos(np.pi / 6), np.sin(np.pi / 6)])
    straight = looking((0.0, 1.0, 0.0), tuple(at))
    angled = Measured(
        straight.scope, straight.tool, Endoscope(angle_deg=30.0), straight.targets
    )
    assert value("angle off axis", straight, "ostium").value == pytest.approx(30.0)
    assert value("angle off axis", angled, "ostium").value == pytest.approx(0, abs=1e-5)


def test_what_lies_behind_or_far_is_not_looked_at() -> None:
    for at in ((0.0, -9.0, 0.0), (0.0, 99.0, 0.0)):
        found = value("centred share", looking((0.0, 1.0, 0.0), at), "ostium")
        assert found.value is None
        assert "never looked at" in found.reason


def test_the_working_distance_has_two_ends() -> None:
    tips = np.stack([0 * TIMES, 3.0 * TIMES, 0 * TIMES], axis=1)
    scope = track(TIMES, tips)
    measured = of_scope(scope, targets={"ostium": np.array([0.0, 35.0, 0.0])})
    # 35 to 5 mm away: the last half lies within 5 to 20 mm
    found = value("working distance share", measured, "ostium")
    assert found.value == pytest.approx(0.5, abs=0.01)
    assert found.intervals[0][0] == pytest.approx(5.0, abs=0.02)


def test_unsteadiness_is_the_rate_of_the_view() -> None:
    """A sway of amplitude A at w has the rms rate A w / sqrt(2)."""
    amplitude, w = np.radians(5.0), 3.0
    angle = amplitude * np.sin(w * TIMES)
    axes = np.stack([np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    found = value("unsteadiness", looking(axes, (0.0, 10.0, 0.0)), "ostium")
    assert found.value == pytest.approx(5.0 * w / np.sqrt(2), rel=0.02)
    pixels = value("pixel motion", looking(axes, (0.0, 10.0, 0.0)), "ostium")
    assert pixels.value == pytest.approx(5.0 * 512 / 80 / np.sqrt(2), rel=0.02)


def test_a_still_scope_is_steady() -> None:
    measured = looking((0.0, 1.0, 0.0), (0.0, 10.0, 1.0))
    assert value("unsteadiness", measured, "ostium").value == pytest.approx(0, abs=1e-6)
    assert value("pixel motion", measured, "ostium").value == pytest.approx(0, abs=1e-6)


def test_a_tool_is_in_view_while_it_is_in_the_cone() -> None:
    x = 20.0 * TIMES / TIMES[-1]
    tool = track(TIMES, np.stack([x, 10.0 + 0 * x, 0 * x], axis=1))
    measured = Measured(track(TIMES, HERE), tool)
    # the field's edge is at 40 degrees
    expected = 10 * np.tan(np.radians(40)) / 20
    assert tool_in_view(measured).value == pytest.approx(expected, abs=0.01)
