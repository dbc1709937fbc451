"""How far a quick picture is from the high-quality one of the same view, and where."""

import math
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from paravol.snapshots.head_scene import HeadScene, placed
from paravol.snapshots.outputs import RenderedPicture
from paravol.snapshots.view_file import ScopeLook, ViewFile
from renderers.scene import Camera, image_error, rmse_codes, save_png, ssim
from renderers.scene.composition import solids_seen
from renderers.scene.deflection import deflected_surface
from renderers.snapshots.request import to_deflection
from system import UserError

if TYPE_CHECKING:
    from PIL.ImageFont import FreeTypeFont, ImageFont

ERROR_SCALE_CODES = 64
"""Error that reaches the end of the colour scale: a quarter of full range."""

_BAND_PX = 44
_INSET_PX = 12
_FONT_PX = (15, 4)
"""Largest and smallest: below nothing can be read, and pictures are tiny."""


@dataclass(frozen=True, slots=True)
class Difference:
    """Compare two encoded pictures.

    rmse: in 8-bit codes. ssim: structural similarity. p99: 99th percentile of the
    largest channel difference, codes.
    """

    rmse: float
    ssim: float
    p99: float


def difference(live: NDArray[np.uint8], snapshot: NDArray[np.uint8]) -> Difference:
    """Measure the difference of two ``(h, w, 3)`` pictures."""
    size = np.abs(live.astype(np.int16) - snapshot.astype(np.int16)).max(axis=-1)
    return Difference(
        rmse_codes(live, snapshot), ssim(live, snapshot), float(np.percentile(size, 99))
    )


def save_comparison(
    path: Path,
    live: NDArray[np.uint8],
    snapshot: NDArray[np.uint8],
    found: Difference,
    *,
    title: str,
    text: dict[str, str],
    names: tuple[str, str] = ("live (FSR)", "snapshot (ART)"),
) -> None:
    """Write two pictures and their error map side by side as one PNG."""
    from matplotlib import colormaps
    from PIL import Image, ImageDraw

    size = np.abs(live.astype(np.int16) - snapshot.astype(np.int16)).max(axis=-1)
    shade = colormaps["inferno"](np.clip(size / ERROR_SCALE_CODES, 0, 1))
    error = (shade[..., :3] * 255 + 0.5).astype(np.uint8)
    height, width = live.shape[:2]
    sheet = Image.new("RGB", (3 * width, height + _BAND_PX))
    draw = ImageDraw.Draw(sheet)
    captions = (
        f"{title}: {names[0]}",
        names[1],
        f"difference, white = {ERROR_SCALE_CODES} codes; RMSE {found.rmse:.1f} codes, "
        f"SSIM {found.ssim:.3f}",
    )
    for column, (picture, caption) in enumerate(
        zip((live, snapshot, error), captions, strict=True)
    ):
        sheet.paste(Image.fromarray(picture), (column * width, _BAND_PX))
        font = _font(caption, width - 2 * _INSET_PX)
        at = column * width + _INSET_PX, _INSET_PX
        draw.text(at, caption, fill=(230, 230, 230), font=font)
    save_png(path, np.asarray(sheet), text)


def _font(caption: str, width_px: int) -> "FreeTypeFont | ImageFont":
    """Choose the largest font in which a caption does not run into what is beside."""
    from PIL import ImageFont

    largest, smallest = _FONT_PX
    for size in range(largest, smallest, -1):
        font = ImageFont.load_default(size=size)
        if font.getlength(caption) <= width_px:
            return font
    return ImageFont.load_default(size=smallest)


@dataclass(frozen=True, slots=True)
class ComparisonReport:
    """Report how far a quick picture is from a fine one.

    codes: of the encoded pictures. light: RMSE of linear light, over its mean; None
    where only the encoded pictures can be compared. file: the error map.
    """

    codes: Difference
    light: float | None
    file: str


def require_splats(view: ViewFile) -> None:
    """Raise UserError for a lens that splats cannot be seen through."""
    if not view.to_camera().distortion.is_none:
        raise UserError(
            "--against fsr draws splats, which know no distorted lens; take a view "
            f"whose camera has none, got {view.camera.distortion}."
        )


def splatted(
    head: HeadScene,
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
    scene = head.seen(view)
    look, surface = view.look, scene.surface
    with closing(
        FuzzySetRenderer(scene, threads=threads, deflection=deflection)
    ) as renderer:
        if not isinstance(look, ScopeLook):
            image = render_among(renderer, camera, solids_seen(camera, tools))
            # splats know no field stop, and rays see nothing beyond it
            image.rgba[:] *= rays_passed(camera, samples)[..., None]
            return image.to_srgb8()
        buffer = renderer.gbuffer(camera)
    assert surface is not None
    for mesh, pose in tools:
        mesh.draw(buffer, camera, pose)
    seen = deflected_surface(surface, deflection)
    with (
        closing(
            ScopeShader(seen, Tier.FLIGHT, look.seed, look.blood_bias, threads)
        ) as shader,
        closing(CameraPass(threads=threads)) as camera_pass,
    ):
        pixels, _ = scope_picture(
            buffer,
            camera,
            shader,
            camera_pass,
            ScopeLight(look.ring_radius_mm, power=look.light_power),
            gain,
            look.frame_number,
            [Caster.of(mesh, pose) for mesh, pose in tools],
            look.lens,
        )
    return pixels


def rays_passed(camera: Camera, samples: int) -> NDArray[np.float32]:
    """Return the share of each pixel's rays that pass the field stop: ``(h, w)``."""
    side = math.isqrt(samples)
    high, wide = camera.height, camera.width
    table = camera.with_size(wide * side, high * side).lens_table()
    passed = table.any(axis=-1).reshape(high, side, wide, side)
    share: NDArray[np.float32] = passed.mean(axis=(1, 3), dtype=np.float32)
    return share


def judge(
    quick: NDArray[np.uint8],
    picture: RenderedPicture,
    file: Path,
    names: tuple[str, str],
    quick_light: NDArray[np.float32] | None = None,
) -> ComparisonReport:
    """Measure a quick picture; write both and their difference as one PNG."""
    found = difference(quick, picture.pixels)
    save_comparison(
        file,
        quick,
        picture.pixels,
        found,
        title=picture.view.title or "picture",
        text=picture.text(),
        names=names,
    )
    light = None
    if quick_light is not None:
        error = image_error(quick_light[..., :3], picture.rgba[..., :3]).rmse
        light = error / max(float(picture.rgba[..., :3].mean()), 1e-30)
    return ComparisonReport(found, light, str(file))
