"""The opened head: what is left of it, its colours, and who is hidden by it."""

from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv
from numpy.typing import NDArray

from app.opengl import probe_offscreen
from app.vtk.head_model import head_model
from app.vtk.overview_scene import LIGHT, OverviewScene
from paravol.slices.cutaway import MARGIN_MM, Cutaway, opened_distance
from renderers.scene import (
    AirSurface,
    Camera,
    Projection,
    Scene,
    TransferFunction,
    Volume,
)
from scenarios import Endoscope, FrameState, tip_frame
from scenarios.instrument_state import NO_TOOL

SPACING_MM = 0.5
MIDDLE_MM = np.array([10.0, 15.0, 15.0])
RADIUS_MM = 6.0
BONE_HU, SOFT_HU = 1200.0, 40.0
PLACES = SPACING_MM * np.indices((61, 61, 61))[::-1].transpose(1, 2, 3, 0)
"""Of all voxels, mm."""


@pytest.fixture(scope="module")
def scene() -> Scene:
    """A block with a round cavity left of its middle; bone above, soft tissue below."""
    apart = np.linalg.norm(PLACES - MIDDLE_MM, axis=-1)
    distance = (RADIUS_MM - apart).astype(np.float32) * -1
    hu = np.where(PLACES[..., 2] > 18, BONE_HU, SOFT_HU)
    hu = np.where(distance < 0, -1000, hu).astype(np.int16)
    spacing, origin = np.full(3, SPACING_MM), np.zeros(3)
    nothing = Volume(np.zeros(distance.shape, np.uint8), spacing, origin)
    surface = AirSurface(
        Volume(distance, spacing, origin, background=1.0), nothing, nothing
    )
    transfer = TransferFunction(
        np.array([-1000.0, 1000.0]), np.ones((2, 3)), np.array([0.0, 1.0])
    )
    return Scene(Volume(hu, spacing, origin), transfer, surface=surface)


@pytest.fixture(scope="module")
def opened(scene: Scene) -> Cutaway:
    """Cut beside a way through the cavity's middle, on the side of the block's."""
    return Cutaway(scene, [MIDDLE_MM - [0, t, 0] for t in (0.0, 2.0, 4.0)])


def from_the_open_side(opened: Cutaway, size: int = 120) -> Camera:
    eye = MIDDLE_MM + np.array([60.0 * opened.towards, 0, 0])
    return Camera.looking_at(
        eye,
        MIDDLE_MM,
        extent=np.radians(10),
        size=(size, size),
        projection=Projection.PERSPECTIVE,
    )


def test_what_is_left_is_the_part_behind_the_plane(scene: Scene) -> None:
    assert scene.surface is not None
    whole = scene.surface.distance
    for towards in (1.0, -1.0):
        left = opened_distance(whole, 9.3, towards)
        rng = np.random.default_rng(3)
        # away from the plane and within its half, nothing changes
        inside = rng.uniform(2, 28, (500, 3))
        behind = -towards * (inside[:, 0] - 9.3)
        kept = behind > 1 + np.abs(whole.sample(inside))
        np.testing.assert_allclose(
            left.sample(inside[kept]), whole.sample(inside[kept]), atol=1e-5
        )
        before = behind < -0.6
        assert left.sample(inside[before]).max() < 0


def test_the_plane_lies_beside_the_way_towards_the_middle(opened: Cutaway) -> None:
    assert opened.towards == 1.0
    assert opened.plane_mm == pytest.approx(MIDDLE_MM[0] + MARGIN_MM)


def test_the_plane_shows_the_scan_and_the_cavity_its_wall(opened: Cutaway) -> None:
    camera = from_the_open_side(opened)
    pixels, depth = opened.draw(camera)
    at, _ = camera.project(
        np.array([[opened.plane_mm, 15, 24], [opened.plane_mm, 15, 5], MIDDLE_MM])
    )
    columns, rows = at.astype(int).T
    bone, soft, wall = pixels[rows, columns].astype(int)
    assert bone.min() > soft.max() + 40
    assert soft.max() - soft.min() < 40
    assert wall[0] > 1.5 * wall[1] > 0
    distance_mm = depth[rows, columns]
    plane_mm = 60 - MARGIN_MM
    np.testing.assert_allclose(distance_mm[:2], plane_mm, atol=1.5)
    assert distance_mm[2] == pytest.approx(60 + RADIUS_MM, abs=0.2)


def test_a_scene_that_cannot_be_cut_is_refused(scene: Scene) -> None:
    with pytest.raises(ValueError, match="along a way, which has no place"):
        Cutaway(scene, [])
    bare = Scene(scene.volume, scene.transfer_function)
    with pytest.raises(ValueError, match="with an air surface"):
        Cutaway(bare, [MIDDLE_MM])


@pytest.fixture
def graphics() -> None:
    if not probe_offscreen().works:
        pytest.skip("no OpenGL library here")


def tip_pixels(picture: NDArray[np.uint8]) -> int:
    light = np.array(pv.Color(LIGHT).int_rgb)
    return int((np.abs(picture.astype(int) - light).max(axis=-1) < 12).sum())


@pytest.mark.display
@pytest.mark.usefixtures("graphics")
def test_the_overview_hides_a_tip_behind_the_wall(
    scene: Scene, opened: Cutaway
) -> None:
    assert scene.surface is not None
    plotter = pv.Plotter(off_screen=True, window_size=[240, 240])
    plotter.disable_anti_aliasing()
    overview = OverviewScene(plotter, Endoscope())
    overview.show_head(head_model(scene.surface, {}))
    shown = {}
    for where, tip in (
        ("in the cavity", MIDDLE_MM),
        ("in the wall", MIDDLE_MM - np.array([RADIUS_MM + 3, 0, 0])),
        ("before the plane", MIDDLE_MM + np.array([MARGIN_MM + 4, 0, 3.0])),
    ):
        pose = tip_frame(tip, np.array([-0.3, 1, 0]))
        camera = Endoscope().camera(pose, 0.0, (32, 32))
        overview.follow(FrameState(camera, pose, np.eye(4), 1.0, instrument=NO_TOOL))
        overview.open_head(opened)
        behind_walls = tip_pixels(overview.picture())
        overview.open_head(None)
        shown[where] = behind_walls, tip_pixels(overview.picture())
    plotter.close()
    # the whole head is the background: a tool is always before it
    assert min(whole for _, whole in shown.values()) > 20
    assert shown["in the cavity"][0] > 20
    assert shown["before the plane"][0] > 20
    assert shown["in the wall"][0] == 0


@pytest.mark.display
@pytest.mark.usefixtures("graphics")
def test_a_head_that_is_cut_is_shown_as_a_new_one_would_be(scene: Scene) -> None:
    """In place of the one before: whole and opened, from the same place."""
    surface = scene.surface
    assert surface is not None
    values = surface.distance.values.copy()
    distance = surface.distance.with_values(values, surface.distance.background)
    living = replace(scene, surface=replace(surface, distance=distance))
    assert living.surface is not None
    model = head_model(living.surface, {})
    way = [MIDDLE_MM - [0, t, 0] for t in (0.0, 2.0, 4.0)]

    def pictures(overview: OverviewScene) -> list[NDArray[np.uint8]]:
        found = [overview.picture()]
        overview.open_head(Cutaway(living, way))
        found.append(overview.picture())
        overview.open_head(None)
        return found

    plotters = [pv.Plotter(off_screen=True, window_size=[200, 200]) for _ in range(2)]
    for plotter in plotters:
        plotter.disable_anti_aliasing()
    overview = OverviewScene(plotters[0], Endoscope())
    overview.show_head(model)
    before = overview.picture()
    # within the bounds of what was there, which place the letters beside it
    hole = np.linalg.norm(PLACES - MIDDLE_MM - 3.3, axis=-1) - 2.4
    np.minimum(values, hole.astype(np.float32), out=values)
    assert model.renew is not None
    overview.renew_head(model.renew())
    after = pictures(overview)
    fresh = OverviewScene(plotters[1], Endoscope())
    fresh.show_head(replace(model, mesh=model.renew()))
    for one, other in zip(after, pictures(fresh), strict=True):
        np.testing.assert_array_equal(one, other)
    assert not np.array_equal(before, after[0])
    for plotter in plotters:
        plotter.close()


@pytest.mark.display
@pytest.mark.usefixtures("graphics")
def test_a_tool_taken_while_the_head_opens_is_not_drawn_before_it(
    scene: Scene, opened: Cutaway
) -> None:
    """The opened head has no pixels yet; who asks for no picture gets none."""
    assert scene.surface is not None
    plotter = pv.Plotter(off_screen=True, window_size=[120, 120])
    overview = OverviewScene(plotter, Endoscope())
    overview.show_head(head_model(scene.surface, {}))
    overview.picture()
    drawn: list[str] = []
    assert plotter.render_window is not None
    plotter.render_window.AddObserver(
        "StartEvent", lambda _, event: drawn.append(event)
    )
    pose = tip_frame(MIDDLE_MM, np.array([-0.3, 1, 0]))
    camera = Endoscope().camera(pose, 0.0, (32, 32))
    overview.open_head(opened)
    for tool in ("curette", "ball probe"):
        overview.follow(FrameState(camera, pose, np.eye(4), 1.0, instrument=tool))
    overview.renew_head(head_model(scene.surface, {}).mesh)
    overview.show_fiducials({"brow": MIDDLE_MM}, 0)
    assert drawn == []
    assert overview.picture().any()
    assert drawn
    plotter.close()
