"""A scan as a volume: looks, orbits, and the same scene by splats and by rays."""

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paravol.volume.look import LookPoint, VolumeLook, load_look, save_look
from paravol.volume.orbit import Orbit
from paravol.volume.presets import presets
from paravol.volume.scan import Scan, scans_of
from paravol.volume.volume_view import Method, PendingRequest, VolumeView
from renderers.scene import Volume
from system import UserError

BALL_MM = 12.0


@pytest.fixture(scope="module")
def ball() -> Volume:
    """A ball of 300 HU in air, with an edge two voxels wide, off the middle."""
    side = np.arange(40.0)
    z, y, x = np.meshgrid(side, side, side, indexing="ij")
    depth = BALL_MM - np.sqrt((x - 24) ** 2 + (y - 20) ** 2 + (z - 16) ** 2)
    values = np.clip(-1000.0 + 1300.0 * (0.5 + depth / 2), -1000.0, 300.0)
    return Volume(values.astype(np.float32), np.ones(3), np.zeros(3))


def orbit_of(volume: Volume) -> Orbit:
    x, y, z = volume.center_mm
    return Orbit((float(x), float(y), float(z)), distance_mm=90.0)


def test_splats_and_rays_show_the_same_scene(ball: Volume) -> None:
    view = VolumeView(scans_of(ball, {}), threads=1)
    look = presets(Scan.of("ct", ball))[2]
    wish = PendingRequest("ct", look, Method.SPLATS, orbit_of(ball), (96, 96))
    drawn = {m: view.draw(replace(wish, method=m)) for m in Method}
    rays = drawn[Method.FINE_RAYS].pixels.astype(float)
    is_ball = rays[..., 0] > 40
    assert 0.1 < is_ball.mean() < 0.5
    for method in (Method.SPLATS, Method.RAYS):
        other = drawn[method].pixels.astype(float)
        # Splats blur the ball's edge and shade each voxel once: 3.9 codes, measured.
        bound = 6.0 if method is Method.SPLATS else 1.0
        assert np.abs(other - rays).mean() < bound, method
    assert drawn[Method.SPLATS].splats == drawn[Method.POINTS].splats
    assert drawn[Method.RAYS].splats is None
    view.close()


def test_what_is_kept_for_a_look_never_shows_in_another(ball: Volume) -> None:
    """Whatever came before, a picture has the bits of one drawn alone."""
    scans = scans_of(ball, {})
    wishes = [
        PendingRequest("ct", replace_points(look), method, orbit_of(ball), (48, 48))
        for look in presets(scans[0])[1:4]
        for method in (Method.SPLATS, Method.RAYS)
    ]
    wishes.append(
        replace(wishes[0], look=msgspec.structs.replace(wishes[0].look, threshold=0.5))
    )
    together = VolumeView(scans, threads=2)
    first = [together.draw(wish).pixels for wish in wishes]
    for wish, before in zip(wishes, first, strict=True):
        alone = VolumeView(scans, threads=1)
        assert np.array_equal(alone.draw(wish).pixels, before)
        assert np.array_equal(together.draw(wish).pixels, before)
        alone.close()
    together.close()


def replace_points(look: VolumeLook) -> VolumeLook:
    return msgspec.structs.replace(look, name="mine")


def test_a_higher_threshold_keeps_fewer_splats(ball: Volume) -> None:
    view = VolumeView(scans_of(ball, {}), threads=1)
    look = presets(Scan.of("ct", ball))[2]
    counts = []
    for threshold in (0.05, 0.3, 0.9):
        some = msgspec.structs.replace(look, threshold=threshold)
        wish = PendingRequest("ct", some, Method.POINTS, orbit_of(ball), (32, 32))
        counts.append(view.draw(wish).splats)
    assert counts[0] > counts[1] > counts[2] >= 0  # type: ignore[operator]
    view.close()


def test_the_patients_right_is_on_the_left_seen_from_the_front(ball: Volume) -> None:
    """The ball lies towards +x, the patient's left, and below the middle."""
    view = VolumeView(scans_of(ball, {}), threads=1)
    look = presets(Scan.of("ct", ball))[2]
    x, y, z = ball.center_mm
    front = Orbit((float(x), float(y), float(z)), 0.0, 0.0, distance_mm=90.0)
    behind = replace(front, azimuth_deg=180.0)
    assert (front.letters(), behind.letters()) == (("R", "L"), ("L", "R"))
    assert replace(front, azimuth_deg=90.0).letters() == ("A", "P")
    for orbit, side in ((front, 1), (behind, -1)):
        wish = PendingRequest("ct", look, Method.RAYS, orbit, (64, 64))
        rows, columns = np.nonzero(view.draw(wish).pixels[..., 0] > 40)
        assert (columns.mean() - 31.5) * side > 4
        assert rows.mean() > 31.5 + 4
    view.close()


@given(
    st.lists(st.tuples(st.floats(-400, 400), st.floats(-200, 200)), max_size=8),
    st.floats(0.01, 100.0),
)
def test_an_orbit_keeps_its_place_in_the_middle(
    turns: list[tuple[float, float]], factor: float
) -> None:
    orbit = Orbit((3.0, -7.0, 11.0))
    for right, up in turns:
        orbit = orbit.turned(right, up)
    orbit = orbit.nearer(factor)
    camera = orbit.camera((20, 20))
    towards = np.array(orbit.centre_mm) - camera.eye_mm
    assert np.linalg.norm(towards) == pytest.approx(orbit.distance_mm)
    assert camera.frame[3] @ towards == pytest.approx(orbit.distance_mm)
    assert camera.frame[2, 2] > 0  # the head's top is up


def test_a_look_comes_back_from_its_file(tmp_path: Path, ball: Volume) -> None:
    for scan in (Scan.of("ct", ball), Scan.of("t1", ball)):
        for look in presets(scan):
            save_look(look, tmp_path / "look.json")
            assert load_look(tmp_path / "look.json") == look
            look.transfer()


BAD = [
    ('"opacity": 0.5', '"opacity": 1.5', "1.5"),
    ("#112233", "red", "'red'"),
    ('"density": 2.0', '"density": 0.0', "0 follows 1"),
    ("threshold", "treshold", "threshold"),
]


@pytest.mark.parametrize(("good", "bad", "named"), BAD)
def test_a_bad_look_is_refused_by_what_is_wrong(
    good: str, bad: str, named: str, tmp_path: Path
) -> None:
    points = (LookPoint(1.0, "#112233", 0.5), LookPoint(2.0, "#112233", 0.5))
    file = tmp_path / "look.json"
    save_look(VolumeLook("mine", points, 1.5), file)
    text = file.read_text()
    assert good in text
    file.write_text(text.replace(good, bad))
    with pytest.raises(UserError, match=named) as refused:
        load_look(file)
    assert "look.json" in str(refused.value)


def test_an_unknown_scan_is_named(ball: Volume) -> None:
    view = VolumeView(scans_of(ball, {}), threads=1)
    look = presets(Scan.of("ct", ball))[0]
    with pytest.raises(UserError, match="'t2'; there is ct"):
        view.draw(PendingRequest("t2", look, Method.POINTS, orbit_of(ball), (8, 8)))


def test_a_histogram_counts_every_eighth_voxel_of_its_range(ball: Volume) -> None:
    scan = Scan.of("ct", ball)
    assert scan.counts.sum() == 20**3
    assert scan.heights().max() == 1.0
    assert scan.heights()[128] == 0.0
