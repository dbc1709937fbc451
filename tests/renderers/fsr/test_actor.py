import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista as pv
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow

from renderers.fsr import FuzzySetRenderer, Inclusion
from renderers.fsr.actor import SplatActor, camera_of
from renderers.scene import Camera, Projection, Scene, TransferFunction, Volume
from tests.offscreen import aim, ball, grab, make_window, opengl_works

SIZE = 192


@pytest.fixture(scope="module")
def renderer() -> FuzzySetRenderer:
    return make_renderer()


def make_renderer() -> FuzzySetRenderer:
    k, j, i = np.indices((40, 40, 40)) - 19.5
    r = np.sqrt(i * i + j * j + k * k)
    hu = 1000 * np.clip(0.5 - (r - 14) / 2, 0, 1) - 1000
    transfer = TransferFunction(
        np.array([-1000.0, -700.0, -300.0, 400.0]),
        np.tile([1.0, 0.5, 0.4], (4, 1)),
        np.array([0.0, 0.0, 3.0, 3.0]),
    )
    scene = Scene(Volume(hu.astype(np.int16), np.ones(3), np.zeros(3)), transfer)
    inclusion = Inclusion.boundary(transfer, 1.0, 300.0)
    return FuzzySetRenderer(scene, inclusion=inclusion, threshold=0.3)


def camera(x: float = 19.5) -> Camera:
    return Camera.looking_at(
        (x, -50, 34),
        (19.5, 19.5, 19.5),
        extent=np.radians(20.0),
        size=(SIZE, SIZE),
        projection=Projection.PERSPECTIVE,
    )


def window_of(actor: SplatActor, view: Camera) -> vtkRenderWindow:
    """Show an actor off screen as a camera sees it."""
    window, scene = make_window(view)
    actor.show_in(scene)
    return window


needs_opengl = pytest.mark.skipif(not opengl_works(), reason="no OpenGL library here")


def test_it_is_exported_and_vtk_is_loaded_only_for_it() -> None:
    code = (
        "import sys, renderers.fsr as fsr;"
        "assert 'vtkmodules' not in sys.modules; fsr.SplatActor;"
        "assert 'vtkmodules' in sys.modules and 'SplatActor' in fsr.__all__"
    )
    root = Path(__file__).parents[3]
    subprocess.run([sys.executable, "-c", code], check=True, cwd=root)


def test_a_scene_in_place_of_splats_is_told_the_right_call(
    renderer: FuzzySetRenderer,
) -> None:
    with pytest.raises(
        TypeError, match=r"SplatActor\(extract_fuzzy_set\(scene\), scene"
    ):
        SplatActor(renderer.scene, renderer.scene)  # type: ignore[arg-type]


@pytest.mark.display
@needs_opengl
def test_the_actor_shows_the_picture_of_the_rasterizer(
    renderer: FuzzySetRenderer,
) -> None:
    actor = SplatActor(renderer.fuzzy_set, renderer.scene)
    window = window_of(actor, camera())
    scene = window.GetRenderers().GetFirstRenderer()
    for x in (19.5, 60.0, -25.0):
        aim(scene, camera(x))
        wanted = renderer.render(camera(x)).to_srgb8().astype(int)
        difference = np.abs(grab(window) - wanted)
        assert wanted.max() > 100
        assert difference.mean() < 2.0
    assert actor.reordered == 3, "a moved camera is followed without being told"


@pytest.mark.display
@needs_opengl
def test_depth_is_that_of_the_rasterizer(renderer: FuzzySetRenderer) -> None:
    actor = SplatActor(renderer.fuzzy_set, renderer.scene)
    view = camera()
    window = window_of(actor, view)
    z = grab(window, depth=True)
    near, far = (
        window.GetRenderers().GetFirstRenderer().GetActiveCamera().GetClippingRange()
    )
    axis_mm = near * far / (far - z * (far - near))
    axis_mm /= view.lens_table()[..., 2]
    wanted = renderer.render(view, with_depth=True)
    depth = wanted.depth_mm
    assert depth is not None
    opaque = wanted.rgba[..., 3] > 0.95
    assert opaque.sum() > 2000
    shown = opaque & (z < 1)
    # all but a rim of the silhouette
    assert shown.sum() > 0.97 * opaque.sum()
    # one is a splat's middle, the other where half the light is gone
    assert np.abs(axis_mm - depth)[shown].mean() < 1.0
    assert np.mean(z[wanted.rgba[..., 3] == 0] == 1) > 0.99


@pytest.mark.display
@needs_opengl
def test_what_is_behind_an_opaque_prop_is_hidden_and_before_it_is_not(
    renderer: FuzzySetRenderer,
) -> None:
    actor = SplatActor(renderer.fuzzy_set, renderer.scene)
    view = camera()
    window = window_of(actor, view)
    alone = grab(window).astype(int)
    for y, covers in ((-20.0, True), (45.0, False)):
        middle_mm = np.array([19.5, y, 19.5 + (19.5 - y) * 14.5 / 69.5])
        prop = ball(middle_mm, 4.0, (0, 1, 0))
        scene = window.GetRenderers().GetFirstRenderer()
        scene.AddActor(prop)
        scene.ResetCameraClippingRange()
        middle = grab(window)[SIZE // 2, SIZE // 2].astype(int)
        scene.RemoveActor(prop)
        assert (middle[1] > 250 and middle[0] < 10) == covers
        assert (np.abs(middle - alone[SIZE // 2, SIZE // 2]).max() <= 2) != covers


@pytest.mark.display
@needs_opengl
def test_it_is_an_actor_of_any_pyvista_scene(renderer: FuzzySetRenderer) -> None:
    actor = SplatActor(renderer.fuzzy_set, renderer.scene)
    plotter: Any = pv.Plotter(off_screen=True, window_size=[SIZE, SIZE])
    plotter.set_background("black")
    plotter.add_actor(actor, reset_camera=False)
    plotter.camera.is_set = True
    aim(plotter.renderer, camera())
    actor.show_in(plotter.renderer)
    picture = np.asarray(plotter.screenshot(return_img=True)).astype(int)
    wanted = renderer.render(camera()).to_srgb8().astype(int)
    assert np.abs(picture[..., :3] - wanted).mean() < 2.0
    assert plotter.renderer.GetViewProps().GetNumberOfItems() == 2
    plotter.close()


@pytest.mark.slow
@pytest.mark.display
@needs_opengl
def test_windows_of_x_and_of_egl_show_the_same(
    renderer: FuzzySetRenderer, tmp_path: Path
) -> None:
    """In children: a process keeps the kind of window that it began with."""
    server = shutil.which("xvfb-run")
    if server is None:
        pytest.skip("there is no Xvfb")
    pictures = []
    for kind, before in (("EGL", []), ("XOpenGL", [server, "-a"])):
        out = tmp_path / f"{kind}.npy"
        subprocess.run(
            [*before, sys.executable, "-c", _CHILD, str(out)],
            check=True,
            timeout=120,
            cwd=Path(__file__).parents[3],
            env=os.environ
            | {
                "VTK_DEFAULT_OPENGL_WINDOW": f"vtk{kind}RenderWindow",
                "PYTHONPATH": f"{Path(__file__).parent}{os.pathsep}.",
            },
        )
        pictures.append(np.load(out).astype(int))
    assert pictures[0].max() > 100
    assert np.abs(pictures[0] - pictures[1]).mean() < 0.5


_CHILD = (
    "import sys, numpy as np, test_actor as t\n"
    "made = t.make_renderer()\n"
    "actor = t.SplatActor(made.fuzzy_set, made.scene)\n"
    "window = t.window_of(actor, t.camera())\n"
    "picture = t.grab(window)\n"
    "np.save(sys.argv[1], picture)\n"
)


def test_a_camera_change_only_reorders(renderer: FuzzySetRenderer) -> None:
    actor = SplatActor(renderer.fuzzy_set, renderer.scene)
    points, colors = actor.data.GetPoints(), actor.data.GetPointData().GetScalars()
    built = points.GetMTime(), points.GetData().GetMTime(), colors.GetMTime()
    seen = []
    for x in (-40.0, 80.0):
        actor.update(camera(x))
        convert: Any = vtk_to_numpy
        order = convert(actor.data.GetVerts().GetConnectivityArray()).copy()
        assert len(order) == actor.drawn
        seen.append(order)
    assert not np.array_equal(*seen)
    assert set(seen[0]) == set(seen[1]) == set(range(len(renderer.fuzzy_set)))
    assert actor.reordered == 2
    assert built == (
        points.GetMTime(),
        points.GetData().GetMTime(),
        colors.GetMTime(),
    ), "nothing was handed over anew"


def test_splats_out_of_view_are_drawn_too_and_first(renderer: FuzzySetRenderer) -> None:
    """With fewer cells than points VTK's mapper writes beyond its memory."""
    actor = SplatActor(renderer.fuzzy_set, renderer.scene)
    near = Camera.looking_at(
        (19.5, 0, 24),
        (19.5, 19.5, 24),
        extent=np.radians(12.0),
        size=(SIZE, SIZE),
        projection=Projection.PERSPECTIVE,
    )
    actor.update(near)
    convert: Any = vtk_to_numpy
    order = convert(actor.data.GetVerts().GetConnectivityArray())
    count = actor.data.GetNumberOfPoints()
    assert 0 < actor.drawn < count / 2
    assert np.array_equal(np.sort(order), np.arange(count))
    shown = renderer.fuzzy_set.rows.centers_mm()[order[-actor.drawn :]]
    distance = np.linalg.norm(shown - near.eye_mm, axis=1)
    # sixteen bits of it are sorted
    assert np.diff(distance).max() < 0.01


@pytest.mark.parametrize("size", [(160, 120), (120, 160)])
@pytest.mark.parametrize(
    "projection", [Projection.PERSPECTIVE, Projection.ORTHOGRAPHIC]
)
def test_a_renderers_camera_is_read_as_it_projects(
    size: tuple[int, int], projection: Projection
) -> None:
    scene = vtkRenderer()
    window = vtkRenderWindow()
    window.SetSize(*size)
    window.AddRenderer(scene)
    eye = scene.GetActiveCamera()
    eye.SetPosition(3.0, -40.0, 7.0)
    eye.SetFocalPoint(1.0, 2.0, 3.0)
    eye.SetViewUp(0.1, 0.0, 1.0)
    eye.SetViewAngle(50.0)
    eye.SetParallelScale(9.0)
    eye.SetParallelProjection(projection is Projection.ORTHOGRAPHIC)
    found = camera_of(scene)
    assert found.projection is projection
    points = np.random.default_rng(1).uniform(-5, 5, (20, 3))
    pixels, _ = found.project(points)
    matrix = eye.GetCompositeProjectionTransformMatrix(size[0] / size[1], 0, 1)
    rows = np.array([[matrix.GetElement(r, c) for c in range(4)] for r in range(4)])
    clip = np.concatenate([points, np.ones((20, 1))], axis=1) @ rows.T
    wanted = (clip[:, :2] / clip[:, 3:] * (1, -1) + 1) / 2 * size
    assert np.allclose(pixels, wanted, atol=1e-6)
