"""Make the sheets of the synthetic heads in ``docs/pictures``.

    python examples/make_contact_sheet.py
    python examples/make_contact_sheet.py --beside patient/ --out out/sheets
    python examples/make_contact_sheet.py --beside patient/ --spine 0 -72 -2 --out out

``anatomy_seeds.png``: four planes of twelve patients drawn from seeds, at bone window
(width 2000 HU, level 350): coronal through the ostiomeatal complex and the sphenoid
sinuses, axial through the ethmoid, sagittal beside the septum. The patient's right is
on the left, as in radiology. ``anatomy_views.png``: what an endoscope sees in twelve
heads, one for each of the variants and diseases named above it.

``--beside``: a folder that ``paravol import`` made; its planes come first, in the same
field of view about the anterior nasal spine, which is judged from where a scope enters.
Where the face is cut off that is wrong: ``--spine`` tells its place. Such a sheet must
go elsewhere (``--out``): a patient's scan is not for the documents.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

import paravol
from anatomy import Phantom, build_phantom, draw_parameters
from anatomy.case import read_case
from renderers.scene import Volume

PICTURES = Path(__file__).parents[1] / "docs" / "pictures"
SEEDS = range(12)
COLUMNS = 2
SPACING_MM = 0.5
FIELD_MM = ((-52.0, 52.0), (-20.0, 92.0), (-14.0, 80.0))
CORONAL_MM = (27.0, 64.0)
AXIAL_MM, SAGITTAL_MM = 38.0, 9.0
NOSTRILS_MM = np.array((0.0, -11.5, -9.0))
"""Between the nostrils of the average head, from its nasal spine; LPS."""
LOW_HU, HIGH_HU = -650.0, 1350.0
SIDE_PX = 224

Place = str | tuple[float, float, float]
VIEWS: tuple[tuple[str, dict[str, tuple[str, ...]], Place, Place, float], ...] = (
    ("average, nostril", {}, "nostril, right", "nasal valve, right", 4.0),
    ("average, middle meatus", {}, "nasal valve, right", "middle meatus, right", 12.0),
    (
        "average, recess",
        {},
        "nostril, right",
        "sphenoethmoidal recess, right",
        48.0,
    ),
    ("average, choana", {}, "nostril, left", "choana, left", 40.0),
    (
        "concha bullosa",
        {"variants": ("concha-bullosa:right",)},
        "nasal valve, right",
        "middle meatus, right",
        10.0,
    ),
    (
        "paradoxical turbinate",
        {"variants": ("paradoxical-turbinate:left",)},
        "nasal valve, left",
        "middle turbinate head, left",
        13.0,
    ),
    (
        "septal spur",
        {"variants": ("septal-spur:right",)},
        "nasal valve, right",
        "choana, right",
        8.0,
    ),
    (
        "septal deviation",
        {"variants": ("septal-deviation",)},
        "nasal valve, right",
        "choana, right",
        4.0,
    ),
    (
        "polyps, grade 2",
        {"disease": ("polyps:right=2",)},
        "nasal valve, right",
        "middle meatus, right",
        8.0,
    ),
    (
        "polyps, grade 3",
        {"disease": ("polyps:left=3",)},
        "nasal valve, left",
        "middle meatus, left",
        4.0,
    ),
    (
        "antrostomy, fluid",
        {
            "disease": (
                "antrostomy:right=120",
                "fluid:maxillary:right=0.3",
                "posture=upright",
            )
        },
        (-8.0, 23.4, 26.2),
        (-19.0, 35.4, 12.4),
        0.0,
    ),
    (
        "congested",
        {"disease": ("congestion=1",)},
        "nasal valve, left",
        "choana, left",
        0.0,
    ),
)
"""Caption, what `paravol.phantom` is asked for, where the scope comes from, where it
looks (landmarks, or LPS, mm), and how far it has come, mm."""


def main() -> None:
    """Build the heads, cut, draw and save."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--beside", type=Path, help="an imported patient's folder")
    parser.add_argument(
        "--spine",
        type=float,
        nargs=3,
        metavar=("X", "Y", "Z"),
        help="where that patient's anterior nasal spine lies: LPS, mm",
    )
    parser.add_argument("--out", type=Path, default=PICTURES)
    chosen = parser.parse_args()
    if chosen.beside is not None and chosen.out == PICTURES:
        parser.error("--beside needs --out: a patient's scan is not for the documents")
    chosen.out.mkdir(parents=True, exist_ok=True)
    cells = [] if chosen.beside is None else [real(chosen.beside, chosen.spine)]
    cells += [drawn(seed) for seed in SEEDS]
    save(cells, COLUMNS, chosen.out / "anatomy_seeds.png")
    save([view(*words) for words in VIEWS], 6, chosen.out / "anatomy_views.png")


def save(cells: list[NDArray[np.uint8]], columns: int, target: Path) -> None:
    """Lay pictures out in rows, as wide as the widest, and write them."""
    wide = max(cell.shape[1] for cell in cells)
    high = max(cell.shape[0] for cell in cells)
    depth = cells[0].shape[2:]
    sheet = np.zeros(
        (-(-len(cells) // columns) * high, columns * wide, *depth), np.uint8
    )
    for i, cell in enumerate(cells):
        top, left = i // columns * high, i % columns * wide
        sheet[top : top + cell.shape[0], left : left + cell.shape[1]] = cell
    Image.fromarray(sheet).save(target, optimize=True)
    print(target)


def drawn(seed: int) -> NDArray[np.uint8]:
    """Give one patient's planes side by side with the seed and the variants."""
    parameters = draw_parameters(seed)
    phantom = build_phantom(parameters, SPACING_MM, field_mm=FIELD_MM)
    words = [v.replace(":left", " L").replace(":right", " R") for v in rare(phantom)]
    line = ", ".join([f"{seed}: keros {parameters.keros_mm:.1f}", *words])
    return labelled(planes(phantom.ct, parameters.head_scale), line)


def rare(phantom: Phantom) -> list[str]:
    """Name the variants that most sides do not have."""
    usual = ("agger", "retrobulbar", "suprabullar")
    return [v for v in phantom.parameters.variants if not v.startswith(usual)]


def real(folder: Path, spine_mm: list[float] | None = None) -> NDArray[np.uint8]:
    """Give an imported patient's planes about its nasal spine; LPS.

    Without a spine it is placed by where a scope enters.
    """
    case = read_case(folder)
    entries = [m.position_mm for m in case.landmarks.values() if "nostril" in m.name]
    entries = entries or [case.landmarks["entrance"].position_mm]
    spine = np.mean(entries, axis=0) - NOSTRILS_MM if spine_mm is None else spine_mm
    about = within_field(case.ct, np.asarray(spine))
    return labelled(planes(about, 1.0), f"{folder.name}: a real scan")


def within_field(ct: Volume, spine_mm: NDArray[np.float64]) -> Volume:
    """Cut a scan to the synthetic heads' field about its spine; air where it ends."""
    low, step = ct.origin_mm - spine_mm, ct.spacing_mm
    first, last = np.round((np.array(FIELD_MM).T - low) / step).astype(int)
    values = np.full((last - first)[::-1], -1000, np.int16)
    begin = np.maximum(first, 0)
    end = np.minimum(last, ct.values.shape[::-1])
    source = tuple(slice(a, b) for a, b in zip(begin[::-1], end[::-1], strict=True))
    target = tuple(
        slice(a, b)
        for a, b in zip((begin - first)[::-1], (end - first)[::-1], strict=True)
    )
    values[target] = ct.values[source]
    return Volume(values, step, low + first * step)


def planes(ct: Volume, scale: float) -> NDArray[np.uint8]:
    """Cut the four planes of a head whose lengths are `scale` times the average's.

    Its nasal spine lies at the origin.
    """
    low, step = np.asarray(ct.origin_mm), np.asarray(ct.spacing_mm)

    def plane(axis: int, at_mm: float) -> NDArray[np.int16]:
        at = round((at_mm * scale - float(low[axis])) / float(step[axis]))
        at = min(max(at, 0), ct.values.shape[2 - axis] - 1)
        cut = np.take(ct.values, at, axis=2 - axis)
        return cut if axis == 2 else cut[::-1]

    wanted = [(1, y) for y in CORONAL_MM] + [(2, AXIAL_MM), (0, SAGITTAL_MM)]
    return np.hstack([grey(plane(*place)) for place in wanted])


def grey(hu: NDArray[np.int16]) -> NDArray[np.uint8]:
    """Show CT numbers at bone window, fitted into a square."""
    share = np.clip((hu.astype(float) - LOW_HU) / (HIGH_HU - LOW_HU), 0.0, 1.0)
    picture = Image.fromarray((255 * share).astype(np.uint8))
    picture.thumbnail((SIDE_PX, SIDE_PX), Image.Resampling.LANCZOS)
    square = Image.new("L", (SIDE_PX + 2, SIDE_PX + 2))
    square.paste(picture)
    return np.asarray(square)


def view(
    caption: str,
    asked: dict[str, tuple[str, ...]],
    start: Place,
    goal: Place,
    forward_mm: float,
) -> NDArray[np.uint8]:
    """Draw what the scope sees in one head."""
    patient = paravol.phantom(seed=1, spacing_mm=SPACING_MM, **asked)
    pose = patient.pose(start, goal, forward_mm=forward_mm)
    look = patient.look(pose, size=SIDE_PX)
    return labelled(look.rgb, caption)


def labelled(cell: NDArray[np.uint8], line: str) -> NDArray[np.uint8]:
    """Write a line above a picture, broken where it is too long."""
    pad = ((34, 6), (3, 3)) + ((0, 0),) * (cell.ndim - 2)
    picture = Image.fromarray(np.pad(cell, pad))
    draw = ImageDraw.Draw(picture)
    rows = [""]
    for word in line.split(" "):
        longer = f"{rows[-1]} {word}".strip()
        if draw.textlength(longer) > picture.width - 12:
            rows.append(word)
        else:
            rows[-1] = longer
    draw.text((6, 4), "\n".join(rows[:2]), fill=230 if cell.ndim == 2 else (230,) * 3)
    return np.asarray(picture)


if __name__ == "__main__":
    main()
