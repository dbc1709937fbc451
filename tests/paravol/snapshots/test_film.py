"""Pictures in a row are exposed as the live camera exposes them."""

from pathlib import Path
from typing import cast

import msgspec
import numpy as np
import pytest

from paravol.snapshots.film import _materials, draw_film
from paravol.snapshots.head_scene import RenderSettings
from paravol.snapshots.render_session import RenderSession
from paravol.snapshots.view_file import PlacedInstrument, ViewFile
from renderers.scene import Material
from renderers.shading import AutoGain, meter
from renderers.snapshots.request import Row
from scenarios import tip_frame
from tests.paravol.snapshots.darkroom import SIZE, Darkroom, view

FPS = 10.0


def shoot(darkroom: Darkroom, views: list[ViewFile], folder: Path) -> None:
    session = cast(RenderSession, darkroom)
    draw_film(session, views, RenderSettings(), (folder,), FPS)


def test_the_gain_follows_what_was_seen(tmp_path: Path) -> None:
    light = [1e-3] * 3 + [1e-2] * 20
    darkroom = Darkroom(light)
    shoot(darkroom, [view()] * len(light), tmp_path)
    metered = [
        meter(np.full((SIZE, SIZE, 3), each, np.float32)) for each in (1e-3, 1e-2)
    ]
    live = AutoGain()
    live.follow(metered[0], 0.0)
    assert darkroom.gains[:4] == [None, *[pytest.approx(metered[0])] * 3]
    for gain in darkroom.gains[4:]:
        assert gain == pytest.approx(live.follow(metered[1], 1 / FPS))
    assert darkroom.gains[-1] == pytest.approx(metered[1], rel=1e-3)


def test_a_gain_that_was_recorded_is_kept(tmp_path: Path) -> None:
    darkroom = Darkroom([1e-3, 1e-2, 1e-2])
    shoot(darkroom, [view(gain) for gain in (50.0, 60.0, 70.0)], tmp_path)
    assert darkroom.gains == [50.0, 60.0, 70.0]


def test_a_film_of_odd_size_is_refused_before_anything_is_drawn(tmp_path: Path) -> None:
    darkroom = Darkroom([1e-3])
    odd = msgspec.structs.replace(view(), size_px=(16, 15))
    films = tmp_path / "frames", tmp_path / "a.mp4"
    with pytest.raises(ValueError, match=r"even sizes.*say --size 16"):
        draw_film(cast(RenderSession, darkroom), [odd], RenderSettings(), films, FPS)
    assert not darkroom.gains
    assert not list(tmp_path.iterdir())


def test_tools_are_told_from_tissue_where_they_are_seen() -> None:
    bare = view()
    assert _materials(bare, np.ones((SIZE, SIZE), np.float32)) is None
    camera = bare.to_camera()
    pose = tip_frame(camera.eye_mm + 10 * camera.frame[3], camera.frame[3])
    pose[:3, 3] += 1.0 * camera.frame[1]
    rows = msgspec.convert(pose[:3].tolist(), tuple[Row, Row, Row])
    held = PlacedInstrument("elevator", rows)
    seen = msgspec.structs.replace(bare, instruments=(held,))
    for depth_mm, is_any in ((60.0, True), (0.2, False)):
        depth = np.full((SIZE, SIZE), depth_mm, np.float32)
        material = _materials(seen, depth)
        assert material is not None
        assert np.any(material == Material.METAL) == is_any
        assert np.any(material == Material.TISSUE)
