"""What a view file in mode classic asks for, tools included."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
import OpenEXR
import pytest
import SimpleITK
from numpy.testing import assert_array_equal

from paravol.snapshots.comparison import rays_passed, splatted
from paravol.snapshots.head_scene import HeadScene, RenderSettings, placed
from paravol.snapshots.outputs import RenderedPicture, save_picture
from paravol.snapshots.view_file import PlacedInstrument, ViewFile, both_eyes, load_view
from renderers.art import ActiveRayTracer, render_among
from renderers.fsr import FuzzySetRenderer
from renderers.fsr import render_among as splat_among
from renderers.scene import Scene
from renderers.scene.composition import solids_seen
from renderers.shading import downsample_radiance
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.worker import run_worker
from scenarios.instruments import instrument_named, suction_tube
from tests.scenes import make_scene

SIZE = 40


@pytest.fixture(scope="module")
def scene() -> Scene:
    return replace(make_scene(), surface=None)


@pytest.fixture(scope="module")
def view(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> ViewFile:
    """A tube that comes out of the small scene's tissue, as a person would write it."""
    tip = scene.volume.center_mm
    record = {
        "schema": "paravol.view/1",
        "head": {"kind": "scan", "file": "none.nii"},
        "camera": {
            "eye_mm": np.add(tip, [26, -18, 10]).tolist(),
            "target_mm": tip.tolist(),
            "extent": 0.5,
        },
        "size_px": [SIZE, SIZE],
        "look": {"mode": "classic"},
        "instruments": [
            {
                "name": "suction tube",
                "world_from_instrument": [
                    [0, 0, 1, tip[0]],
                    [1, 0, 0, tip[1]],
                    [0, 1, 0, tip[2]],
                ],
            }
        ],
    }
    path = tmp_path_factory.mktemp("views") / "a.view.json"
    path.write_text(json.dumps(record))
    return load_view(path)


def taken(
    scene: Scene, view: ViewFile, settings: RenderSettings, folder: Path
) -> RenderedPicture:
    client = SnapshotClient(folder)
    request = HeadScene(scene, "").request(client, view, settings)
    client.submit(request)
    assert run_worker(folder, once=True) == 1
    return RenderedPicture.of(view, client.wait(request.id))


@pytest.mark.parametrize("apart_mm", [0.0, 2.0])
def test_a_view_with_a_tool_has_the_bits_of_render_among(
    scene: Scene, view: ViewFile, tmp_path: Path, apart_mm: float
) -> None:
    """One eye, and each of a pair; files have the depth of tissue and tool."""
    if apart_mm:
        view = both_eyes(view, apart_mm)[1]
    camera = view.to_camera()
    tools = placed(view.instruments)
    drawn = taken(scene, view, RenderSettings(samples=1), tmp_path / "one")
    tracer = ActiveRayTracer(scene, threads=1)
    image = render_among(tracer, camera, solids_seen(camera, tools))
    assert_array_equal(drawn.rgba, image.rgba)
    assert_array_equal(drawn.depth_mm, image.depth_mm)
    assert_array_equal(drawn.pixels, image.to_srgb8())
    fine = camera.with_size(2 * SIZE, 2 * SIZE)
    whole = taken(scene, view, RenderSettings(), tmp_path / "four")
    rays = render_among(tracer, fine, solids_seen(fine, tools))
    assert_array_equal(whole.rgba, downsample_radiance(rays.rgba))
    bare = taken(
        scene,
        msgspec.structs.replace(view, instruments=()),
        RenderSettings(samples=1),
        tmp_path / "bare",
    )
    assert (drawn.depth_mm < bare.depth_mm).mean() > 0.02
    for name in ("a.exr", "a.nrrd", "a.png"):
        save_picture(tmp_path / name, drawn)
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        assert_array_equal(file.channels()["Z"].pixels, drawn.depth_mm)
        assert_array_equal(file.channels()["RGBA"].pixels, drawn.rgba)
    nrrd = SimpleITK.ReadImage(str(tmp_path / "a.nrrd"))
    assert_array_equal(SimpleITK.GetArrayFromImage(nrrd), drawn.depth_mm)
    said = msgspec.json.decode(drawn.text()["View"], type=ViewFile)
    assert said.instruments == view.instruments


@pytest.mark.parametrize("samples", [1, 4])
def test_splats_have_the_same_tool_within_the_same_stop(
    scene: Scene, view: ViewFile, samples: Literal[1, 4], tmp_path: Path
) -> None:
    camera = view.to_camera()
    found = splatted(HeadScene(scene, ""), view, None, 1, samples)
    share = rays_passed(camera, samples)
    solids = solids_seen(camera, placed(view.instruments))
    renderer = FuzzySetRenderer(scene, threads=1)
    try:
        expected = splat_among(renderer, camera, solids)
    finally:
        renderer.close()
    expected.rgba[:] *= share[..., None]
    assert_array_equal(found, expected.to_srgb8())
    # rays see nothing where none pass, and at the rim some of a pixel's do
    drawn = taken(scene, view, RenderSettings(samples=samples), tmp_path)
    assert not drawn.rgba[share == 0].any()
    assert set(np.unique(share)) == set(np.linspace(0, 1, samples + 1))
    assert np.all(found[(solids.coverage > 0) & (share == 1)].max(axis=-1) > 20)


def test_a_tool_with_jaws_is_placed_in_parts(view: ViewFile) -> None:
    tube = view.instruments[0]
    forceps = PlacedInstrument("straight forceps", tube.world_from_instrument, 0.5)
    pose = np.vstack([np.array(tube.world_from_instrument), [0, 0, 0, 1]])
    found = placed((tube, forceps))
    tool = instrument_named("straight forceps")
    wanted = [(suction_tube(), pose), *tool.placed(pose, 0.5)]
    assert len(found) == len(wanted) == 4
    for (mesh, here), (same, there) in zip(found, wanted, strict=True):
        assert_array_equal(mesh.vertices, same.vertices)
        assert_array_equal(here, there)
