"""A picture beside the quick one of the same view: how far that is off, and where."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from disk import UserError
from paravol.snapshots.comparison import Difference, difference, save_comparison
from paravol.snapshots.outputs import Drawn
from paravol.snapshots.studio import Studio, placed
from paravol.snapshots.view_file import ScopeLook, ViewFile
from renderers.scene import Camera, image_error
from renderers.scene.composition import solids_seen
from renderers.scene.deflection import deflected_surface
from renderers.snapshots.deflector_request import to_deflection


@dataclass(frozen=True, slots=True)
class Judged:
    """Say how far a quick picture is from a fine one.

    codes: of the encoded pictures. light: RMSE of linear light, over its mean; None
    where only the encoded pictures can be compared. file: the error map.
    """

    codes: Difference
    light: float | None
    file: str


def demand_splats(view: ViewFile) -> None:
    """Raise ValueError for a lens that splats cannot be seen through."""
    if not view.to_camera().distortion.is_none:
        raise UserError(
            "--against fsr draws splats, which know no distorted lens; take a view "
            f"whose camera has none, got {view.camera.distortion}."
        )


def splatted(
    studio: Studio,
    view: ViewFile,
    gain: float | None,
    threads: int,
    samples: int = 1,
) -> NDArray[np.uint8]:
    """Draw a view as the live picture shows it, with a fine picture's gain.

    samples: rays of each of the fine picture's pixels; some of those at the rim of a
    field stop pass it.
    """
    from renderers.fsr import FuzzySetRenderer, render_among
    from renderers.shading import (
        CameraPass,
        Caster,
        ScopeLight,
        ScopeShader,
        Tier,
        scope_picture,
    )

    camera = view.to_camera()
    deflection = to_deflection(view.deflectors)
    tools = placed(view.instruments)
    renderer = FuzzySetRenderer(studio.scene, threads=threads, deflection=deflection)
    try:
        look = view.look
        if not isinstance(look, ScopeLook):
            image = render_among(renderer, camera, solids_seen(camera, tools))
            # splats know no field stop, and rays see nothing beyond it
            image.rgba[:] *= rays_passed(camera, samples)[..., None]
            return image.to_srgb8()
        assert studio.scene.surface is not None
        buffer = renderer.gbuffer(camera)
        for mesh, pose in tools:
            mesh.draw(buffer, camera, pose)
        shader = ScopeShader(
            deflected_surface(studio.scene.surface, deflection),
            Tier.LIVE,
            look.seed,
            look.blood_bias,
            threads,
        )
        camera_pass = CameraPass(threads=threads)
        light = ScopeLight(look.ring_radius_mm, power=look.light_power)
        try:
            pixels, _ = scope_picture(
                buffer,
                camera,
                shader,
                camera_pass,
                light,
                gain,
                look.frame_number,
                [Caster.of(mesh, pose) for mesh, pose in tools],
            )
        finally:
            shader.close()
            camera_pass.close()
        return pixels
    finally:
        renderer.close()


def rays_passed(camera: Camera, samples: int) -> NDArray[np.float32]:
    """Give the share of each pixel's rays that there are: ``(h, w)``."""
    side = math.isqrt(samples)
    high, wide = camera.height, camera.width
    table = camera.with_size(wide * side, high * side).lens_table()
    passed = table.any(axis=-1).reshape(high, side, wide, side)
    share: NDArray[np.float32] = passed.mean(axis=(1, 3), dtype=np.float32)
    return share


def judge(
    quick: NDArray[np.uint8],
    drawn: Drawn,
    file: Path,
    names: tuple[str, str],
    quick_light: NDArray[np.float32] | None = None,
) -> Judged:
    """Measure a quick picture; write both and their difference as one PNG."""
    found = difference(quick, drawn.pixels)
    save_comparison(
        file,
        quick,
        drawn.pixels,
        found,
        title=drawn.view.title or "picture",
        text=drawn.text(),
        names=names,
    )
    light = None
    if quick_light is not None:
        error = image_error(quick_light[..., :3], drawn.rgba[..., :3]).rmse
        light = error / max(float(drawn.rgba[..., :3].mean()), 1e-30)
    return Judged(found, light, str(file))
