"""What is seen, against closed forms: cones in balls, walls, mirrors, clocks."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from renderers.scene import Camera, Volume
from renderers.scene.lens_state import CLEAN, LensState, all_over
from renderers.shading.camera.camera_settings import CameraSettings
from scenarios import Endoscope, Sample, Session, tip_frame
from scenarios.coverage import CoverageWatch, Mucosa, SeenPercent, mucosa_of
from scenarios.coverage import watch as watching
from scenarios.coverage.sites import OTHER
from scenarios.tasks import Status, TaskEngine
from scenarios.tasks import task as tasks
from tests.scenarios.coverage.rooms import lopsided_room, sphere_room, walled_room

SCOPE = Endoscope()
ROOM = sphere_room()
PATCHES = mucosa_of(ROOM)
FRONT = np.array([0.0, 1.0, 0.0])


def camera(forward: np.ndarray = FRONT, eye: tuple[float, ...] = (0, 0, 0)) -> Camera:
    return SCOPE.camera(tip_frame(np.array(eye), forward), 0.0, (16, 16))


def stare(
    mucosa: Mucosa,
    room: Volume,
    cameras: list[Camera],
    lens: LensState = CLEAN,
    hold_s: float = 0.6,
) -> CoverageWatch:
    watch, time_s = CoverageWatch(mucosa), 0.0
    for seen in cameras:
        until_s = time_s + hold_s
        while time_s < until_s - 1e-9:
            watch.step(time_s, seen, room, lens)
            time_s += 0.1
        # nobody saw how it came to the next view
        time_s += 1.0
    return watch


def share(watch: CoverageWatch) -> float:
    area = watch.mucosa.area_mm2
    return float(area[watch.seen].sum() / area.sum())


@pytest.mark.parametrize("radius_mm", [8.0, 12.0])
def test_the_share_seen_of_a_ball_is_the_solid_angle_of_the_cone(
    radius_mm: float,
) -> None:
    room = sphere_room(radius_mm)
    way = np.array([0.32, 0.83, -0.46])
    watch = stare(mucosa_of(room), room, [camera(way / np.linalg.norm(way))])
    cone = (1.0 - math.cos(math.radians(SCOPE.field_of_view_deg / 2))) / 2
    site = watch.figures().sites[OTHER]
    assert abs(site.seen_percent - 100.0 * cone) < 2 * site.uncertain_percent
    assert site.uncertain_percent < 2.0
    assert share(watch) == pytest.approx(cone, abs=0.005)


def test_a_wall_hides_what_is_behind_it() -> None:
    room = walled_room()
    mucosa = mucosa_of(room)
    watch = stare(mucosa, room, [camera(eye=(-2.0, -4.0, 0.0))])
    seen = mucosa.places[watch.seen]
    assert len(seen) > 50
    assert seen[:, 1].max() < 4.9
    assert share(watch) > 0.02


def test_turning_round_sees_all_of_it() -> None:
    around = [*np.eye(3), *-np.eye(3)]
    corners = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
    views = [camera(way) for way in [*around, *(corners / math.sqrt(3))]]
    assert share(stare(PATCHES, ROOM, views)) > 0.995


@settings(max_examples=5, deadline=None)
@given(st.lists(st.integers(0, 5), min_size=2, max_size=5))
def test_what_was_seen_stays_seen(turns: list[int]) -> None:
    ways = np.concatenate([np.eye(3), -np.eye(3)])
    watch, last = CoverageWatch(PATCHES), 0.0
    for n, turn in enumerate(turns):
        for m in range(3):
            watch.step(2.0 * n + 0.2 * m, camera(ways[turn]), ROOM)
            assert share(watch) >= last
            last = share(watch)
    assert last > 0.0


@pytest.mark.parametrize("rate_hz", [11.0, 60.0, 997.0])
def test_how_often_samples_come_changes_a_look_at_most(rate_hz: float) -> None:
    watch, coarse = CoverageWatch(PATCHES), CoverageWatch(PATCHES)
    for n in range(int(2.0 * rate_hz)):
        watch.step(n / rate_hz, camera(), ROOM)
    for n in range(10):
        coarse.step(n / 5.0 + 1e-9, camera(), ROOM)
    assert np.abs(watch.looks - coarse.looks).max() <= 1
    assert np.array_equal(watch.seen, coarse.seen)


def test_a_flash_a_dirty_lens_a_near_wall_and_a_swing_do_not_count() -> None:
    assert share(stare(PATCHES, ROOM, [camera()], hold_s=0.15)) == 0.0
    soiled = LensState(blood=all_over(0.6))
    assert share(stare(PATCHES, ROOM, [camera()], soiled)) == 0.0
    assert share(stare(PATCHES, ROOM, [camera(eye=(0.0, 9.0, 0.0))])) < 0.01
    swung = CoverageWatch(PATCHES)
    for n in range(10):
        angle = math.radians(100.0) * 0.2 * n
        way = np.array([math.cos(angle), math.sin(angle), 0.0])
        swung.step(0.2 * n + 1e-9, camera(way), ROOM)
    # 100 degrees a second are a blur; the first look has no before
    assert swung.looks.max() == 1


def test_the_picture_is_sharp_from_where_its_blur_is_within_the_limit() -> None:
    of_pictures = CameraSettings()
    assert of_pictures.focus_mm == watching.FOCUS_MM
    assert of_pictures.defocus_px == watching.DEFOCUS_PX
    near = watching.nearest_sharp_mm()
    blur = watching.DEFOCUS_PX * (6 / near - 6 / watching.FOCUS_MM - watching.SHARP)
    assert blur == pytest.approx(watching.MOST_BLUR_PX)


def test_a_mirrored_head_has_the_mirrored_percents() -> None:
    room, mirrored = lopsided_room()
    way = np.array([0.6, 0.8, 0.0])
    back = way * (-1.0, 1.0, 1.0)
    one = stare(mucosa_of(room), room, [camera(way, (-4.0, 0.0, 0.5))])
    other = stare(mucosa_of(mirrored), mirrored, [camera(back, (4.0, 0.0, 0.5))])
    assert share(one) > 0.05
    assert share(one) == pytest.approx(share(other), abs=0.003)


def test_frozen_and_restored_it_goes_on_to_the_bit() -> None:
    places = {"ahead": np.array([0.0, 9.9, 0.0]), "behind": np.array([0.0, -9.9, 0.0])}
    whole, halved = CoverageWatch(PATCHES, places), CoverageWatch(PATCHES, places)
    turns = [FRONT, FRONT, -FRONT]

    def run(watch: CoverageWatch, first: int, last: int) -> None:
        for n in range(first, last):
            watch.step(0.1 * n, camera(turns[n // 10]), ROOM)

    run(whole, 0, 30)
    run(halved, 0, 15)
    state = halved.checkpoint()
    run(halved, 15, 22)
    halved.restore(state)
    run(halved, 15, 30)
    assert np.array_equal(whole.looks, halved.looks)
    assert whole.figures() == halved.figures()
    found = whole.figures().landmarks_s
    assert list(found) == ["ahead", "behind"]
    assert found["ahead"] < 1.0 < 2.0 < found["behind"]


def test_a_survey_is_done_when_enough_was_seen_and_the_score_says_how_much() -> None:
    survey = tasks.Survey(name="survey", title="Look around", sites={OTHER: 10.0})
    session = Session(
        SCOPE,
        np.eye(4),
        ROOM,
        {},
        (8, 8),
        tasks=TaskEngine((survey,), {}),
        coverage=CoverageWatch(PATCHES),
    )
    nothing = np.full(3, np.nan)
    pose = tip_frame(np.zeros(3), FRONT)
    before = session.checkpoint()
    for n in range(8):
        sample = Sample(0.1 * n, pose, 0.0, nothing, FRONT, 0)
        session.step(sample)
    assert session.score().tasks[0].status is Status.DONE
    coverage = session.score().coverage
    assert coverage is not None
    assert coverage.sites[OTHER].seen_percent > 10.0
    session.restore(before)
    again = session.score().coverage
    assert again is not None
    assert again.sites[OTHER].seen_percent == 0.0


def test_sites_can_be_asked_for_by_name_with_a_side_or_for_both() -> None:
    half = PATCHES.places[:, 0] > 0
    sided = dataclasses.replace(
        PATCHES, site=half.astype(np.int64), sites=("septum, right", "septum, left")
    )
    watch = stare(sided, ROOM, [camera(np.array([1.0, 0.0, 0.0]))])
    percent = SeenPercent(watch)
    left, right = percent["septum, left"], percent["septum, right"]
    assert left > 20.0
    assert right == 0.0
    area = sided.area_mm2
    both = (left * area[half].sum() + right * area[~half].sum()) / area.sum()
    assert percent["septum"] == pytest.approx(both)
    assert percent.get("spleen") is None
    assert set(percent) == {"septum", "septum, left", "septum, right"}
