from collections.abc import Callable, Iterator

import numpy as np

from renderers.fsr import FuzzySet
from renderers.fsr.splats import SplatMode, SplatRasterizer
from renderers.fsr.splats.splat_film import draw_film
from renderers.scene import Camera, Projection, Scene
from renderers.scene.thread_team import ThreadTeam

Splats = tuple[FuzzySet, Scene]


def path() -> list[tuple[Camera, SplatMode]]:
    """Give views around a set, from outside and among the splats, in all modes."""
    modes = list(SplatMode)
    return [
        (
            Camera.looking_at(
                (5 + radius * np.sin(turn), 5 - radius * np.cos(turn), 5.5),
                (5, 5, 4.5),
                extent=0.6,
                size=(75, 66),
                projection=Projection.PERSPECTIVE,
            ),
            modes[turn % 3],
        )
        for turn in range(6)
        for radius in (3.0, 14.0)
    ]


def test_a_film_has_the_bits_of_single_pictures(
    three: ThreadTeam, blob: Callable[..., Splats]
) -> None:
    drawer, other = SplatRasterizer(*blob()), SplatRasterizer(*blob())
    pictures = list(draw_film(drawer, three, path()))
    assert len(pictures) == len(path())
    for (camera, mode), picture in zip(path(), pictures, strict=True):
        single = other.draw(camera, three, mode)
        assert single.rgba[..., 3].max() > 0
        assert picture.rgba.tobytes() == single.rgba.tobytes()


def test_the_next_view_is_taken_before_a_picture_is_given(
    team: ThreadTeam, blob: Callable[..., Splats]
) -> None:
    taken = []

    def watched() -> Iterator[tuple[Camera, SplatMode]]:
        for number, view in enumerate(path()):
            taken.append(number)
            yield view

    pictures = draw_film(SplatRasterizer(*blob()), team, watched())
    for number, _ in enumerate(pictures):
        assert taken[-1] == min(number + 1, len(path()) - 1)


def test_no_views_give_no_pictures(
    team: ThreadTeam, blob: Callable[..., Splats]
) -> None:
    assert list(draw_film(SplatRasterizer(*blob()), team, [])) == []
