import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.fsr import FuzzySetRenderer, Inclusion
from renderers.fsr.actor import SplatActor, opengl_works
from renderers.scene import Camera, Projection, Scene, TransferFunction, Volume

SIZE = 192


@pytest.fixture(scope="module")
def renderer() -> FuzzySetRenderer:
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


def draw(actor: SplatActor, view: Camera) -> NDArray[np.uint8]:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkRenderingCore import (
        vtkRenderer,
        vtkRenderWindow,
        vtkWindowToImageFilter,
    )

    scene = vtkRenderer()
    SplatActor.prepare(scene)
    scene.AddActor(actor)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(SIZE, SIZE)
    window.AddRenderer(scene)
    eye = scene.GetActiveCamera()
    eye.SetPosition(*view.eye_mm)
    eye.SetFocalPoint(*(view.eye_mm + view.frame[3]))
    eye.SetViewUp(*view.frame[2])
    eye.SetViewAngle(np.degrees(2 * view.extent))
    scene.ResetCameraClippingRange()
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    convert: object = vtk_to_numpy
    assert callable(convert)
    flat: NDArray[np.uint8] = convert(grab.GetOutput().GetPointData().GetScalars())
    return flat.reshape(SIZE, SIZE, 3)[::-1].copy()


@pytest.mark.display
def test_the_actor_shows_the_picture_of_the_rasterizer(
    renderer: FuzzySetRenderer,
) -> None:
    if not opengl_works():
        pytest.skip("no OpenGL library here")
    actor = SplatActor(renderer.fuzzy_set, renderer.scene)
    for x in (19.5, 60.0):
        view = camera(x)
        actor.update(view)
        wanted = renderer.render(view).to_srgb8().astype(int)
        difference = np.abs(draw(actor, view) - wanted)
        assert wanted.max() > 100
        assert difference.mean() < 2.5


def test_a_camera_change_only_reorders(renderer: FuzzySetRenderer) -> None:
    actor = SplatActor(renderer.fuzzy_set, renderer.scene)
    data = actor.GetMapper().GetInput()
    seen = []
    for x in (-40.0, 80.0):
        actor.update(camera(x))
        points = [data.GetPoint(n) for n in range(actor.drawn)]
        seen.append(points)
    assert seen[0] != seen[1]
    assert set(seen[0]) == set(seen[1])
