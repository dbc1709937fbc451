"""Only the newest is kept, and what is told is what happened."""

import io
import json
import math
import threading
import weakref
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from devices.port import DeviceError, DeviceReason
from paravol.flight import flight_events as events
from paravol.instructor.flight_watcher import (
    LARGEST_PIXELS,
    MOST_INJURIES,
    FlightWatcher,
)
from scenarios import load_scenario
from tests.paravol.instructor.made_flight import Hazards, frame


@pytest.fixture
def watcher() -> FlightWatcher:
    return FlightWatcher(load_scenario("first_flight")[0])


def told(watcher: FlightWatcher, event: Any) -> dict[str, Any]:
    watcher.hear(event)
    state: dict[str, Any] = json.loads(json.dumps(watcher.state(), allow_nan=False))
    return state


def test_all_frames_but_the_newest_are_forgotten(watcher: FlightWatcher) -> None:
    seen = []
    for number in range(20):
        pixels = np.zeros((64, 64, 3), np.uint8)
        seen.append(weakref.ref(pixels))
        watcher.hear(frame(number, pixels))
        if number % 3 == 0:
            watcher.picture()
            watcher.state()
        del pixels
    watcher.picture()
    watcher.state()
    assert [ref() is not None for ref in seen] == [False] * 19 + [True]


def test_a_picture_is_encoded_once_however_many_ask(
    watcher: FlightWatcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    encoded = []
    real = Image.Image.save

    def save(*words: Any, **more: Any) -> None:
        encoded.append(0)
        real(*words, **more)

    monkeypatch.setattr(Image.Image, "save", save)
    assert watcher.picture() is None
    pixels = np.full((2 * LARGEST_PIXELS, LARGEST_PIXELS, 3), 90, np.uint8)
    watcher.hear(frame(1, pixels))
    asking = [threading.Thread(target=watcher.picture) for _ in range(8)]
    for thread in asking:
        thread.start()
    for thread in asking:
        thread.join()
    assert len(encoded) == 1
    picture = watcher.picture()
    assert picture is not None
    image = Image.open(io.BytesIO(picture))
    assert image.size == (LARGEST_PIXELS // 2, LARGEST_PIXELS)
    assert image.getpixel((0, 0)) == (90, 90, 90)


def test_nobody_encodes_or_measures_where_nobody_looks(
    watcher: FlightWatcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Image, "fromarray", None)
    hazards = SimpleNamespace(names=None)
    watcher.hear(events.HeadLoaded(SimpleNamespace(hazards=hazards)))  # type: ignore[arg-type]
    for number in range(5):
        watcher.hear(frame(number))


def test_hazards_are_told_nearest_first_without_the_septum_and_what_is_far(
    watcher: FlightWatcher,
) -> None:
    assert told(watcher, frame(1))["hazards"] is None
    hazards = Hazards(orbit=5.0, septum=0.1, **{"optic nerve": 2.5}, artery=22.0)
    watcher.hear(events.HeadLoaded(SimpleNamespace(hazards=hazards)))  # type: ignore[arg-type]
    found = told(watcher, frame(2))["hazards"]
    # a tool's tip is one point, the shaft is thicker than a line
    radius_mm = watcher.scenario.scope.diameter_mm / 2
    assert [hazard["name"] for hazard in found] == ["optic nerve", "orbit"]
    assert found[0]["mm"] == pytest.approx(2.5 - radius_mm)


def test_state_follows_what_happens(watcher: FlightWatcher) -> None:
    assert watcher.state()["stage"] == "Preparing"
    watcher.hear(events.Progressed("Building the head", 0.4))
    assert watcher.state()["stage"] == "Building the head: 40 %"
    watcher.hear(events.RecordingBegan(0.31))
    state = told(watcher, frame(123))
    assert state["stage"] == "Flying"
    sides = {
        side["letters"]: (round(side["x"]), round(side["y"]))
        for side in state["letters"]
    }
    # the scope looks back, so the patient's left is on the right
    assert sides == {"L": (1, 0), "R": (-1, 0), "S": (0, -1), "I": (0, 1)}
    assert state["looks"] == "P"
    assert state["scope"] == f"{watcher.scenario.scope.angle_deg:g}°"
    changed = replace(frame(1).sample, scope_deg=45.0)
    assert told(watcher, frame(1, sample=changed))["scope"] == "45°"
    state = told(watcher, frame(123))
    assert state["clock_s"] == pytest.approx(12.3)
    assert state["tool"] == "microdebrider · working · suction on"
    assert state["residual_mm"] == 0.31
    task = state["tasks"][0]
    assert (task["status"], task["progress"]) == ("open", 0.5)
    view = SimpleNamespace(**vars(frame(1).view) | {"clearance_mm": math.inf})
    assert told(watcher, frame(1, view=view))["clearance_mm"] is None
    watcher.hear(
        events.DeviceLost(DeviceError(DeviceReason.DISCONNECTED, "The arm went away."))
    )
    assert watcher.state()["device"] == "away: The arm went away."
    watcher.hear(events.DeviceBack(2.0))
    assert watcher.state()["device"] == "there again after 2.0 s"
    assert watcher.state()["is_over"] is False
    watcher.hear(events.FlightOver(None))
    assert watcher.state()["is_over"] is True
    assert watcher.state()["stage"] == "The flight is over"


def test_all_injuries_count_and_the_newest_are_told(watcher: FlightWatcher) -> None:
    for number in range(MOST_INJURIES + 7):
        watcher.hear(events.Injured(f"injury {number}"))
    state = watcher.state()
    assert state["injury_count"] == MOST_INJURIES + 7
    assert len(state["injuries"]) == MOST_INJURIES
    assert state["injuries"][-1]["text"] == f"injury {MOST_INJURIES + 6}"


def test_who_waits_is_woken_by_news_and_not_before(watcher: FlightWatcher) -> None:
    version = watcher.wait(-1, 0.0)
    assert watcher.wait(version, 0.0) == version
    found: list[int] = []
    waiting = threading.Thread(target=lambda: found.append(watcher.wait(version, 60.0)))
    waiting.start()
    watcher.hear(frame(1))
    waiting.join(30.0)
    assert found == [version + 1]
