"""Swept volume and touched area against bodies whose size is known."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from scenarios.coverage import Mucosa
from scenarios.endoscope import Endoscope
from scenarios.metrics import Contacts, Measured, Settings
from scenarios.metrics.swept import swept_mm3, touched_mm2
from tests.scenarios.metrics.tracks import NO_TRACK, of_scope, track

Doubles = NDArray[np.float64]

RADIUS, LENGTH = 2.0, 30.0
TIMES = np.arange(0.0, 2.0, 0.01)
SCOPE = Endoscope(diameter_mm=2 * RADIUS)
STILL_MM3 = math.pi * RADIUS**2 * (LENGTH - 2 * RADIUS) + 4 / 3 * math.pi * RADIUS**3


def moving(to_mm: tuple[float, float, float], **more: Any) -> Measured:
    """A scope along +y whose tip goes straight, evenly, from the origin."""
    tips = TIMES[:, None] / TIMES[-1] * np.array(to_mm)
    return of_scope(track(TIMES, tips), endoscope=SCOPE, **more)


def mm3(measured: Measured) -> float:
    value = swept_mm3(measured).value
    assert value is not None
    return value


@pytest.mark.parametrize(
    ("to_mm", "more_mm3"),
    [
        ((0.0, 0.0, 0.0), 0.0),
        ((0.0, 20.0, 0.0), math.pi * RADIUS**2 * 20.0),
        # sideways: a slab between two halves of the capsule
        (
            (12.0, 0.0, 0.0),
            12.0 * (2 * RADIUS * (LENGTH - 2 * RADIUS) + math.pi * RADIUS**2),
        ),
    ],
)
def test_the_volume_is_that_of_the_body_that_was_swept(
    to_mm: tuple[float, float, float], more_mm3: float
) -> None:
    assert mm3(moving(to_mm)) == pytest.approx(STILL_MM3 + more_mm3, rel=0.03)


def test_a_way_that_is_gone_again_adds_nothing() -> None:
    once = moving((9.0, 0.0, 4.0))
    tips = np.concatenate([once.scope.tip_mm, once.scope.tip_mm[::-1]])
    times = np.arange(len(tips)) * 0.01
    again = replace(once, scope=track(times, tips))
    assert mm3(again) == pytest.approx(mm3(once), rel=0.01)


def test_a_pose_far_from_every_head_is_left_out() -> None:
    once = moving((9.0, 0.0, 4.0))
    tips = np.concatenate([once.scope.tip_mm, np.full((20, 3), 1e7)])
    times = np.arange(len(tips)) * 0.01
    times[-20:] += 5.0
    away = replace(once, scope=track(times, tips))
    assert mm3(away) == pytest.approx(mm3(once), rel=0.01)


def test_without_a_path_there_is_no_volume() -> None:
    found = swept_mm3(of_scope(NO_TRACK))
    assert found.value is None
    assert found.reason.startswith("not enough data")


def wall(depth_mm: float, patch_mm: float = 0.125) -> Mucosa:
    """A wall below the scope, whose axis lies `depth_mm` above it."""
    x, y = np.meshgrid(np.arange(-4, 16, patch_mm), np.arange(-130, 4, patch_mm))
    places = np.stack([x.ravel(), y.ravel(), np.full(x.size, -depth_mm)], axis=1)
    none = np.zeros(0)
    area = np.full(len(places), patch_mm**2)
    kept: dict[str, Any] = dict.fromkeys(Mucosa.__dataclass_fields__, none)
    return Mucosa(**{**kept, "places": places, "area_mm2": area})


def touching(to_mm: tuple[float, float, float], depth_mm: float) -> Measured:
    gap = np.full(len(TIMES), depth_mm - RADIUS)
    contacts = Contacts(TIMES, gap, np.zeros(len(TIMES), np.int64), ("wall",))
    return moving(to_mm, contacts=contacts, mucosa=wall(depth_mm))


@pytest.mark.parametrize("across_mm", [0.0, 10.0])
def test_the_area_is_what_the_shaft_cuts_out_of_a_wall(across_mm: float) -> None:
    depth_mm = 1.6
    half_mm = math.sqrt(RADIUS**2 - depth_mm**2)
    # straight shaft of 110 mm behind the tip's ball, and the ends of that capsule
    wanted = (2 * half_mm + across_mm) * 110.0 + math.pi * half_mm**2
    found = touched_mm2(touching((across_mm, 0.0, 0.0), depth_mm))
    assert found.value == pytest.approx(wanted + across_mm * 2 * half_mm, rel=0.03)
    assert found.sigma is not None
    assert 0.0 < found.sigma < 0.1 * wanted


def test_what_is_touched_again_counts_once_and_no_contact_is_no_area() -> None:
    once = touching((10.0, 0.0, 0.0), 1.6)
    tips = np.concatenate([once.scope.tip_mm, once.scope.tip_mm[::-1]])
    times: Doubles = np.arange(len(tips), dtype=np.float64) * 0.01
    nowhere = np.zeros(len(times), np.int64)
    contacts = Contacts(times, np.full(len(times), -0.4), nowhere, ("wall",))
    again = replace(once, scope=track(times, tips), contacts=contacts)
    assert touched_mm2(again).value == pytest.approx(touched_mm2(once).value)
    clear = replace(contacts, gap_mm=np.full(len(times), 0.5))
    assert touched_mm2(replace(again, contacts=clear)).value == 0.0


def test_a_head_that_nobody_measured_has_no_touched_area() -> None:
    assert touched_mm2(moving((1.0, 0.0, 0.0))).value is None
    nothing = replace(touching((1.0, 0.0, 0.0), 1.6), mucosa=None)
    assert touched_mm2(nothing).value is None


def test_the_length_of_the_end_is_a_setting() -> None:
    short = moving((0.0, 0.0, 0.0), settings=Settings(swept_length_mm=10.0))
    less = math.pi * RADIUS**2 * (LENGTH - 10.0)
    assert mm3(short) == pytest.approx(STILL_MM3 - less, rel=0.03)
