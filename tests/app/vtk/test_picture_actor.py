"""Pictures of the processor among VTK's props: who hides whom, pixel by pixel."""

import numpy as np
import pytest
from numpy.typing import NDArray
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow

from app.opengl import probe_offscreen
from app.vtk.picture_actor import PictureActor
from renderers.scene import Camera, Projection
from tests.offscreen import ball, grab, make_window

WIDTH, HEIGHT = 160, 120
WALL_MM = 20.0
RADIUS_MM = 6.0
GREEN = (0.0, 1.0, 0.0)


@pytest.fixture(scope="module", autouse=True)
def opengl() -> None:
    if not probe_offscreen().works:
        pytest.skip("no OpenGL library here")


def camera(projection: Projection = Projection.PERSPECTIVE) -> Camera:
    return Camera.looking_at(
        (3.0, -5.0, 2.0),
        (3.0, 20.0, 4.0),
        extent=np.radians(30.0),
        size=(WIDTH, HEIGHT),
        projection=projection,
    )


def wall(view: Camera) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """A chequered wall across the axis at WALL_MM, with a window on its left."""
    depth = (WALL_MM / view.lens_table()[..., 2]).astype(np.float32)
    depth[:, : WIDTH // 4] = np.inf
    pixels = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    pixels[..., 0] = 100 + 100 * (np.indices((HEIGHT, WIDTH)).sum(axis=0) % 2)
    return pixels, depth


def scene_of(view: Camera) -> tuple[vtkRenderWindow, vtkRenderer]:
    window, renderer = make_window(view)
    renderer.GetActiveCamera().SetClippingRange(1.0, 100.0)
    return window, renderer


@pytest.mark.display
def test_before_its_first_picture_it_is_not_drawn(
    capfd: pytest.CaptureFixture[str],
) -> None:
    """Whoever draws the scene meanwhile draws the rest of it."""
    window, renderer = scene_of(camera())
    renderer.AddActor(PictureActor())
    assert grab(window).max() == 0
    assert "ERR|" not in capfd.readouterr().err


@pytest.mark.display
def test_alone_it_shows_its_pixels_and_its_depth() -> None:
    view = camera()
    pixels, depth = wall(view)
    window, renderer = scene_of(view)
    actor = PictureActor()
    actor.show(pixels, depth, view)
    renderer.AddActor(actor)
    shown = grab(window).astype(int)
    seen = np.isfinite(depth)
    assert np.array_equal(shown[seen], pixels[seen])
    assert not shown[~seen].any()
    z = grab(window, depth=True)
    near, far = renderer.GetActiveCamera().GetClippingRange()
    axis_mm = near * far / (far - z * (far - near))
    assert np.abs(axis_mm[seen] - WALL_MM).max() < 0.01
    assert np.all(z[~seen] == 1)


@pytest.mark.display
def test_a_ball_half_behind_the_wall_is_half_hidden() -> None:
    view = camera()
    pixels, depth = wall(view)
    window, renderer = scene_of(view)
    middle = view.eye_mm + WALL_MM * view.frame[3] + 3.0 * view.frame[1]
    middle += 4.0 * view.frame[3]
    actor = PictureActor()
    actor.show(pixels, depth, view)
    renderer.AddActor(actor)
    renderer.AddActor(ball(middle, RADIUS_MM, GREEN))
    shown = grab(window)
    origin, ray = view.rays()
    b = ((origin - middle) * ray).sum(axis=-1)
    root = b * b - ((origin - middle) ** 2).sum(axis=-1) + RADIUS_MM**2
    hit = np.where(root > 0, -b - np.sqrt(np.maximum(root, 0)), np.inf)
    wanted = hit < depth
    green = (shown[..., 1] > 200) & (shown[..., 0] < 50)
    hidden = np.isfinite(hit) & ~wanted
    assert wanted.sum() > 500
    assert hidden.sum() > 500
    # but for pixels on the ball's outline and on the circle where both meet
    with np.errstate(invalid="ignore"):
        edge = np.abs(hit - depth) < 0.05
    edge |= np.abs(root) < 1.5
    assert edge.mean() < 0.1
    assert np.array_equal(green[~edge], wanted[~edge])


@pytest.mark.display
def test_through_the_window_the_scene_is_seen() -> None:
    view = camera()
    window, renderer = scene_of(view)
    actor = PictureActor()
    actor.show(*wall(view), view)
    renderer.AddActor(actor)
    left = view.eye_mm + 40 * view.frame[3] - 20.0 * view.frame[1]
    renderer.AddActor(ball(left, RADIUS_MM, GREEN))
    green = grab(window)[..., 1] > 200
    assert green[:, : WIDTH // 4].sum() > 300
    assert not green[:, WIDTH // 4 :].any()


@pytest.mark.display
def test_the_next_picture_takes_its_place() -> None:
    view = camera()
    pixels, depth = wall(view)
    window, renderer = scene_of(view)
    actor = PictureActor()
    renderer.AddActor(actor)
    for shade in (30, 90):
        pixels[...] = shade
        actor.show(pixels, depth, view)
        assert grab(window)[HEIGHT // 2, WIDTH // 2].tolist() == [shade] * 3


def test_what_does_not_fit_is_refused() -> None:
    pixels, depth = wall(camera())
    with pytest.raises(ValueError, match="not with projection equidistant"):
        PictureActor().show(pixels, depth, camera(Projection.EQUIDISTANT))
    with pytest.raises(ValueError, match="do not fit a camera of 160 x 120"):
        PictureActor().show(pixels[1:], depth, camera())
