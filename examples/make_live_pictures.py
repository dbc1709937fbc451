"""Make the pictures of the live view in ``docs/pictures``.

    python examples/make_live_pictures.py

``first_flight.png``: six moments of the bundled flight as the trainee sees them.
``nasal_views.png``: the six views in which a surgeon should know where he is, each live
by splats beside the ray tracer's snapshot of the same pose with the same gain.
``first_operation.png``: four moments of the bundled operation.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from benchmarks.gallery.gallery_views import operated_samples
from benchmarks.nasal_views import (
    NasalView,
    acceptance_views,
    bundled_flight,
    nasal_scene,
)
from devices import load_probe_path
from paravol.patient import PatientScene, load_patient, load_phantom
from paravol.session_setup import (
    LIVE_TIER,
    SEED,
    build_session,
    build_view,
    operate_on,
    path_view,
)
from paravol.view import EndoscopeView
from renderers.art import ActiveRayTracer
from renderers.fsr import FuzzySetRenderer
from renderers.shading import CameraPass, ScopeShader, Tier, scope_picture
from scenarios import load_scenario

Picture = NDArray[np.uint8]

PICTURES = Path(__file__).parents[1] / "docs" / "pictures"
SIDE = 384
CAPTION_PX = 24
MOMENTS_S = (0.5, 6.5, 9.5, 15.0, 18.5, 20.0)
OPERATED_S = (2.6, 4.3, 9.0, 18.3)


def main() -> None:
    """Draw the sheets."""
    save(first_flight(), columns=3, name="first_flight.png")
    save(first_operation(), columns=4, name="first_operation.png")
    save(nasal_views(), columns=4, name="nasal_views.png")


def first_flight() -> list[Picture]:
    """Fly to the moments; the gain settles at each."""
    scenario, path = bundled_flight()
    patient: PatientScene = load_patient(scenario, lambda stage, share: None)
    view: EndoscopeView = build_view(
        scenario, patient, tier=LIVE_TIER, seed=SEED, has_instrument=True, threads=2
    )
    pictures = []
    for number, time_s in enumerate(MOMENTS_S):
        seen = path_view(scenario, patient, path, time_s, (SIDE, SIDE))
        pictures.append(view.draw(seen, number=number, elapsed_s=10.0).pixels)
    return pictures


def first_operation() -> list[Picture]:
    """Operate up to the moments; the gain settles at each."""
    scenario, folder = load_scenario("first_operation")
    path = load_probe_path(folder / scenario.path)
    patient, operation = operate_on(load_phantom())
    size = (SIDE, SIDE)
    session = build_session(scenario, patient, np.eye(4), size, operation)
    view: EndoscopeView = build_view(
        scenario, patient, tier=LIVE_TIER, seed=SEED, has_instrument=True, threads=2
    )
    pictures: list[Picture] = []
    for sample in operated_samples(path, scenario.scope.endoscope()):
        session.step(sample)
        if sample.time_s >= OPERATED_S[len(pictures)]:
            view.apply(operation.take_changes())
            seen, number = session.view(sample), len(pictures)
            pictures.append(view.draw(seen, number=number, elapsed_s=10.0).pixels)
            if len(pictures) == len(OPERATED_S):
                break
    return pictures


def nasal_views() -> list[Picture]:
    """Give live picture and snapshot in turn, captioned."""
    views = acceptance_views(SIDE)
    return [picture for view in views for picture in both(view)]


def both(view: NasalView) -> tuple[Picture, Picture]:
    """Draw a view by splats in tier LIVE and by rays in tier SNAPSHOT."""
    scene = nasal_scene(view.head)
    assert scene.surface is not None
    camera_pass = CameraPass()
    traced, gain = scope_picture(
        ActiveRayTracer(scene).gbuffer(view.camera.with_size(2 * SIDE, 2 * SIDE)),
        view.camera,
        ScopeShader(scene.surface, Tier.SNAPSHOT, seed=SEED),
        camera_pass,
        view.light,
    )
    live, _ = scope_picture(
        FuzzySetRenderer(scene).gbuffer(view.camera),
        view.camera,
        ScopeShader(scene.surface, Tier.LIVE, seed=SEED),
        camera_pass,
        view.light,
        gain,
    )
    return captioned(live, f"{view.name}: live"), captioned(traced, "snapshot")


def captioned(picture: Picture, text: str) -> Picture:
    """Put a line of text above a picture."""
    sheet = Image.fromarray(np.pad(picture, ((CAPTION_PX, 0), (0, 0), (0, 0))))
    font = ImageFont.load_default(size=15)
    ImageDraw.Draw(sheet).text((8, 4), text, fill=(220, 220, 220), font=font)
    return np.asarray(sheet)


def save(pictures: list[Picture], columns: int, name: str) -> None:
    """Lay pictures of one size out in rows and write them."""
    rows = [
        np.hstack(pictures[start : start + columns])
        for start in range(0, len(pictures), columns)
    ]
    target = PICTURES / name
    Image.fromarray(np.vstack(rows)).save(target, optimize=True)
    print(target)


if __name__ == "__main__":
    main()
