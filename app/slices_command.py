"""`paravol slices`: the three planes of a case and its histogram as one picture."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from anatomy import classic_transfer_function
from anatomy.case import Case, read_case
from anatomy.histogram import counts_of
from app.slice_views import Plane, Show, SliceViews, cut
from app.terminal import Stages, print_json
from renderers.scene import TransferFunction, save_png, srgb_from_linear

PANEL_PX = 480
MARGIN_PX = 8
INK, QUIET, CROSS = (230, 230, 230), (150, 158, 166), (255, 209, 102)
TINT_SHARE = 0.45

LEAST_SHARE = 1e-5
"""Of the voxels: the foot of the histogram's logarithmic axis."""


def run_slices(
    *,
    case: Path,
    at: tuple[float, float, float] | None,
    show: str,
    tint: bool,
    out: Path | None,
    as_json: bool,
) -> int:
    """Draw, write, tell what is at the point."""
    target = case / "slices.png" if out is None else out
    if target.suffix.lower() != ".png":
        raise ValueError(f"--out must name a .png file, got {target}.")
    with Stages() as stages:
        stages("Reading the case", 0.0)
        read = read_case(case)
        stages("Reading the case", 1.0)
        place = _place(read) if at is None else np.array(at)
        sheet = slice_sheet(read, place, Show(show), tint=tint)
        save_png(target, sheet, {"Software": "PARAVOL"})
    values = {
        name: float(volume.sample(place))
        for name, volume in read.volumes.items()
        if name in ("ct", "mr", "t1", "t2", "distance")
    }
    air = _label(read, place)
    if as_json:
        nodes = _transfer(read).nodes.tolist()
        here = {"at_mm": place.tolist(), "label": air, "values": values}
        print_json({"file": str(target), **here, "nodes": nodes})
    else:
        told = ", ".join(f"{name} {value:.1f}" for name, value in values.items())
        where = " ".join(f"{v:.1f}" for v in place)
        print(f"{target}: at {where} mm lies {air}; {told}")
    return 0


def slice_sheet(
    case: Case, at_mm: NDArray[np.float64], show: Show, *, tint: bool = True
) -> NDArray[np.uint8]:
    """Draw the three planes through a point and the histogram, ``(h, w, 3)``.

    tint: colour the labels. Raises ValueError for a point outside the case.
    """
    low = case.ct.origin_mm
    high = low + (np.array(case.ct.shape[::-1]) - 1) * case.ct.spacing_mm
    if not np.all((at_mm >= low) & (at_mm <= high)):
        raise ValueError(
            f"the point {np.round(at_mm, 1).tolist()} lies outside the case, which "
            f"reaches from {np.round(low, 1).tolist()} to {np.round(high, 1).tolist()}"
        )
    transfer = _transfer(case)
    views = SliceViews.of(case.volumes, transfer)
    panels = [_panel(case, views, plane, at_mm, show, tint) for plane in Plane]
    panels.append(_histogram(case, transfer))
    side = PANEL_PX + MARGIN_PX
    sheet = Image.new("RGB", (2 * side + MARGIN_PX, 2 * side + MARGIN_PX))
    for number, panel in enumerate(panels):
        row, column = divmod(number, 2)
        sheet.paste(panel, (MARGIN_PX + side * column, MARGIN_PX + side * row))
    return np.asarray(sheet)


def _place(case: Case) -> NDArray[np.float64]:
    approach = case.record.approach
    return case.ct.center_mm if approach is None else np.array(approach.pivot_mm)


def _transfer(case: Case) -> TransferFunction:
    stored = case.record.transfer
    return classic_transfer_function() if stored is None else stored.function()


def _label(case: Case, at_mm: NDArray[np.float64]) -> str:
    at = np.rint((at_mm - case.labels.origin_mm) / case.labels.spacing_mm).astype(int)
    value = int(case.labels.values[at[2], at[1], at[0]])
    return case.record.label_names.get(str(value), "no label")


def _panel(
    case: Case,
    views: SliceViews,
    plane: Plane,
    at_mm: NDArray[np.float64],
    show: Show,
    tint: bool,
) -> Image.Image:
    pixels = views.picture(plane, at_mm, show)
    if tint:
        pixels = _tinted(pixels, np.asarray(cut(case.labels, plane, at_mm)))
    scale = PANEL_PX / max(pixels.shape[:2])
    size = (round(pixels.shape[1] * scale), round(pixels.shape[0] * scale))
    panel = Image.new("RGB", (PANEL_PX, PANEL_PX))
    left, top = ((PANEL_PX - length) // 2 for length in size)
    smooth = Image.Resampling.BICUBIC
    panel.paste(Image.fromarray(pixels).resize(size, smooth), (left, top))
    draw = ImageDraw.Draw(panel)
    column, row = views.place(plane, at_mm)
    x, y = left + (column + 0.5) * scale, top + (row + 0.5) * scale
    for a, b in ((12, 4), (-12, -4)):
        draw.line([(x + a, y), (x + b, y)], fill=CROSS, width=2)
        draw.line([(x, y + a), (x, y + b)], fill=CROSS, width=2)
    font = ImageFont.load_default(size=18)
    middle, end = PANEL_PX / 2, PANEL_PX - 6
    places = ((6, middle, "lm"), (end, middle, "rm"), (middle, 4, "mt"))
    for letter, (u, v, anchor) in zip(
        plane.letters, (*places, (middle, end, "mb")), strict=True
    ):
        draw.text((u, v), letter, fill=INK, font=font, anchor=anchor)
    sources = case.record.sources
    shown = "CT and MR" if show is Show.BOTH else show.value.upper()
    if show is Show.CT and sources:
        # a case made of an MR alone keeps it on the scale of CT
        shown = sources[0].modality
    name = f"{plane.name.lower()}, {shown}"
    draw.text((6, 4), name, fill=QUIET, font=ImageFont.load_default(size=14))
    return panel


def _tinted(
    pixels: NDArray[np.uint8], labels: NDArray[np.generic]
) -> NDArray[np.uint8]:
    """Colour labels; neighbours in number differ in hue by the golden section."""
    hue = np.arange(256)[:, None] * 0.618 + np.array([0.0, 1 / 3, 2 / 3])
    colors = 127.5 + 127.5 * np.cos(2 * np.pi * hue)
    index = np.asarray(labels, np.int64)
    share = np.where(index > 0, TINT_SHARE, 0.0)[..., None]
    mixed = (1 - share) * pixels + share * colors[index]
    result: NDArray[np.uint8] = np.rint(mixed).astype(np.uint8)
    return result


def _histogram(case: Case, transfer: TransferFunction) -> Image.Image:
    """Draw the CT's histogram over the transfer function's colours and extinction."""
    centers, shares = counts_of(case.ct)
    panel = Image.new("RGB", (PANEL_PX, PANEL_PX))
    draw: Any = ImageDraw.Draw(panel)
    small = ImageFont.load_default(size=13)
    left, right, top, bottom = 14, PANEL_PX - 14, 40, PANEL_PX - 36
    low, high = float(centers[0]), float(centers[-1])

    def across(hu: float) -> float:
        return left + (right - left) * (hu - low) / (high - low)

    columns = np.arange(left, right)
    at = low + (columns - left) / (right - left) * (high - low)
    color, kappa = transfer.evaluate(at)
    encoded = np.rint(255 * srgb_from_linear(color)).astype(int)
    counts = np.log10(np.maximum(np.interp(at, centers, shares), LEAST_SHARE))
    heights = (counts - np.log10(LEAST_SHARE)) / -np.log10(LEAST_SHARE)
    for x, height, rgb in zip(
        columns.tolist(), heights.tolist(), encoded.tolist(), strict=True
    ):
        foot = bottom - height * (bottom - top)
        draw.line([(x, bottom), (x, foot)], fill=tuple(rgb))
    most = float(transfer.kappa_per_mm.max())
    curve = [
        (x, bottom - k / most * (bottom - top))
        for x, k in zip(columns.tolist(), kappa.tolist(), strict=True)
    ]
    draw.line(curve, fill=CROSS, width=2)
    for number, (node, extinction) in enumerate(
        zip(transfer.nodes.tolist(), transfer.kappa_per_mm.tolist(), strict=True)
    ):
        center, y = across(node), bottom - extinction / most * (bottom - top)
        draw.ellipse([center - 4, y - 4, center + 4, y + 4], outline=INK, width=2)
        row = bottom + 4 + 14 * (number % 2)
        draw.text((center, row), f"{node:.0f}", fill=INK, font=small, anchor="mt")
    draw.text((6, 4), "histogram (log) and transfer function, HU", fill=QUIET,
              font=ImageFont.load_default(size=14))  # fmt: skip
    note = f"line: extinction, up to {most:.0f} per mm"
    draw.text((6, 22), note, fill=CROSS, font=small)
    return panel
