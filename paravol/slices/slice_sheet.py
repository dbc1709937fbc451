"""The three planes of a case and its histogram as one picture."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from anatomy import classic_transfer_function
from anatomy.case import Case
from anatomy.scan.histogram import counts_of
from paravol.slices.slice_views import Plane, Show, SliceViews, cut
from renderers.scene import TransferFunction, srgb_from_linear
from system import UserError

PANEL_PX = 480
MARGIN_PX = 8
INK, QUIET, CROSS = (230, 230, 230), (150, 158, 166), (255, 209, 102)
Marked = Literal["outlines", "tint", "none"]
"""How a slice shows its labels."""
TINT_SHARE = 0.25
OUTLINE_SHARE = 0.75
"""Of a label's colour, in a tint and in an outline: the CT is read through both."""
LEGEND_COLUMNS, LEGEND_ROW_PX, SWATCH_PX = 4, 20, 12

LEAST_SHARE = 1e-5
"""Of the voxels: the foot of the histogram's logarithmic axis."""


def slice_sheet(
    case: Case,
    at_mm: NDArray[np.float64],
    show: Show,
    labels: Marked = "outlines",
) -> NDArray[np.uint8]:
    """Draw the three planes through a point and the histogram, ``(h, w, 3)``.

    labels: how the planes show them; below stands a legend of those that they show.
    Raises UserError for a point outside the case.
    """
    low = case.ct.origin_mm
    high = low + (np.array(case.ct.shape[::-1]) - 1) * case.ct.spacing_mm
    if not np.all((at_mm >= low) & (at_mm <= high)):
        raise UserError(
            f"the point {np.round(at_mm, 1).tolist()} lies outside the case, which "
            f"reaches from {np.round(low, 1).tolist()} to {np.round(high, 1).tolist()}"
        )
    transfer = transfer_of(case)
    views = SliceViews.of(case.volumes, transfer)
    panels = [_panel(case, views, plane, at_mm, show, labels) for plane in Plane]
    panels.append(_histogram(case, transfer))
    side = PANEL_PX + MARGIN_PX
    wide = 2 * side + MARGIN_PX
    legend = _legend(case, at_mm, labels, wide)
    sheet = Image.new("RGB", (wide, wide + legend.height))
    sheet.paste(legend, (0, wide))
    for number, panel in enumerate(panels):
        row, column = divmod(number, 2)
        sheet.paste(panel, (MARGIN_PX + side * column, MARGIN_PX + side * row))
    return np.asarray(sheet)


def entrance_of(case: Case) -> NDArray[np.float64]:
    approach = case.record.approach
    return case.ct.center_mm if approach is None else np.array(approach.pivot_mm)


def transfer_of(case: Case) -> TransferFunction:
    stored = case.record.transfer
    return classic_transfer_function() if stored is None else stored.function()


def label_at(case: Case, at_mm: NDArray[np.float64]) -> str:
    at = np.rint((at_mm - case.labels.origin_mm) / case.labels.spacing_mm).astype(int)
    value = int(case.labels.values[at[2], at[1], at[0]])
    return case.record.label_names.get(str(value), "no label")


def _panel(
    case: Case,
    views: SliceViews,
    plane: Plane,
    at_mm: NDArray[np.float64],
    show: Show,
    labels: Marked,
) -> Image.Image:
    pixels = views.picture(plane, at_mm, show)
    scale = PANEL_PX / max(pixels.shape[:2])
    size = (round(pixels.shape[1] * scale), round(pixels.shape[0] * scale))
    panel = Image.new("RGB", (PANEL_PX, PANEL_PX))
    left, top = ((PANEL_PX - length) // 2 for length in size)
    large = np.asarray(Image.fromarray(pixels).resize(size, Image.Resampling.BICUBIC))
    if labels != "none":
        found = np.asarray(cut(case.labels, plane, at_mm), np.uint8)
        nearest = Image.fromarray(found).resize(size, Image.Resampling.NEAREST)
        large = marked(large, np.asarray(nearest), labels)
    panel.paste(Image.fromarray(large), (left, top))
    draw = ImageDraw.Draw(panel)
    column, row = views.place(plane, at_mm)
    x, y = left + (column + 0.5) * scale, top + (row + 0.5) * scale
    for a, b in ((12, 4), (-12, -4)):
        draw.line([(x + a, y), (x + b, y)], fill=CROSS, width=2)
        draw.line([(x, y + a), (x, y + b)], fill=CROSS, width=2)
    middle, end = PANEL_PX / 2, PANEL_PX - 6
    places = ((6, middle, "lm"), (end, middle, "rm"), (middle, 4, "mt"))
    for letter, (u, v, anchor) in zip(
        plane.letters, (*places, (middle, end, "mb")), strict=True
    ):
        draw.text((u, v), letter, fill=INK, font_size=18, anchor=anchor)
    sources = case.record.sources
    shown = "CT and MR" if show is Show.BOTH else show.value.upper()
    if show is Show.CT and sources:
        # a case made of an MR alone keeps it on the scale of CT
        shown = sources[0].modality
    name = f"{plane.name.lower()}, {shown}"
    draw.text((6, 4), name, fill=QUIET, font_size=14)
    return panel


def marked(
    pixels: NDArray[np.uint8], labels: NDArray[np.uint8], how: Marked
) -> NDArray[np.uint8]:
    """Tint labels ``(h, w)`` in a picture ``(h, w, 3)``, or draw their outlines.

    An outline lies inside its label, one pixel wide. Label 0 stays as it is.
    """
    share = np.where(labels > 0, TINT_SHARE, 0.0)
    if how == "outlines":
        edge = np.zeros(labels.shape, np.bool_)
        down, across = labels[1:] != labels[:-1], labels[:, 1:] != labels[:, :-1]
        edge[1:] |= down
        edge[:-1] |= down
        edge[:, 1:] |= across
        edge[:, :-1] |= across
        share = np.where(edge & (labels > 0), OUTLINE_SHARE, 0.0)
    colors = label_colors()[labels]
    mixed = pixels + share[..., None] * (colors - pixels)
    result: NDArray[np.uint8] = np.rint(mixed).astype(np.uint8)
    return result


def label_colors() -> NDArray[np.float64]:
    """Return ``(256, 3)`` sRGB; neighbours in number differ by the golden section.

    Hues come near to each other again after 8, 13 and 21 numbers: those differ in
    lightness. All are light enough to be seen on the black of air.
    """
    number = np.arange(256)[:, None]
    wave = np.cos(2 * np.pi * (number * 0.618 + np.array([0.0, 1 / 3, 2 / 3])))
    middle = np.array([150.0, 110.0, 195.0, 130.0])[number // 8 % 4]
    return np.asarray(middle + np.minimum(middle - 25, 255 - middle) * wave)


def _legend(
    case: Case, at_mm: NDArray[np.float64], labels: Marked, wide: int
) -> Image.Image:
    """Name the colours of the labels that the planes show, in the labels' order."""
    shown: set[int] = set()
    if labels != "none":
        cuts = (np.unique(cut(case.labels, plane, at_mm)) for plane in Plane)
        shown = {int(value) for values in cuts for value in values} - {0}
    names = case.record.label_names
    rows = -(-len(shown) // LEGEND_COLUMNS)
    high = rows * LEGEND_ROW_PX + MARGIN_PX if rows else 0
    legend = Image.new("RGB", (wide, high))
    draw = ImageDraw.Draw(legend)
    colors = np.rint(label_colors()).astype(int).tolist()
    for number, value in enumerate(sorted(shown)):
        column, row = divmod(number, rows)
        x = MARGIN_PX + column * (wide - MARGIN_PX) // LEGEND_COLUMNS
        y = row * LEGEND_ROW_PX + (LEGEND_ROW_PX - SWATCH_PX) // 2
        box = [x, y, x + SWATCH_PX, y + SWATCH_PX]
        draw.rectangle(box, fill=tuple(colors[value]))
        place = (x + SWATCH_PX + 6, y + SWATCH_PX / 2)
        name = names.get(str(value), f"label {value}")
        draw.text(place, name, fill=INK, font_size=14, anchor="lm")
    return legend


def _histogram(case: Case, transfer: TransferFunction) -> Image.Image:
    """Draw the CT's histogram over the transfer function's colours and extinction."""
    centers, shares = counts_of(case.ct)
    panel = Image.new("RGB", (PANEL_PX, PANEL_PX))
    draw = ImageDraw.Draw(panel)
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
        draw.text((center, row), f"{node:.0f}", fill=INK, font_size=13, anchor="mt")
    title = "histogram (log) and transfer function, HU"
    draw.text((6, 4), title, fill=QUIET, font_size=14)
    note = f"line: extinction, up to {most:.0f} per mm"
    draw.text((6, 22), note, fill=CROSS, font_size=13)
    return panel
