"""Pictures in a row are exposed as the live camera exposes them."""

from pathlib import Path
from typing import cast

import msgspec
import numpy as np
import pytest

from paravol.snapshots.film import draw_film
from paravol.snapshots.head_scene import RenderSettings
from paravol.snapshots.render_session import RenderSession
from paravol.snapshots.view_file import ViewFile
from renderers.shading import AutoGain, meter
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
        draw_film(
            cast(RenderSession, darkroom),
            [odd],
            RenderSettings(),
            films,
            FPS,
        )
    assert not darkroom.gains
    assert not list(tmp_path.iterdir())
