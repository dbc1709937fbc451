"""How far a live picture was from the high-quality one of the same pose."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.scene import rmse_codes, save_png, ssim

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


def _font(caption: str, width_px: int) -> Any:
    """Choose the largest font in which a caption does not run into what is beside."""
    from PIL import ImageFont

    largest, smallest = _FONT_PX
    for size in range(largest, smallest, -1):
        font: Any = ImageFont.load_default(size=size)
        if font.getlength(caption) <= width_px:
            return font
    return ImageFont.load_default(size=smallest)
