"""What was seen, painted on the anatomy: an opened nose, and slices across it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image as PilImage
from PIL import ImageDraw

from paravol.patient import (
    PatientScene,
    Progress,
    StrPath,
    load_patient,
    no_progress,
)
from paravol.sessions.session_setup import flown_scenario, reopen_session
from renderers.scene import Volume
from scenarios.bundle import read_recording
from scenarios.coverage import CoverageWatch
from scenarios.coverage.sites import SEPTUM_MM
from system import UserError

Doubles = NDArray[np.float64]
Pixels = NDArray[np.uint8]

SCALE = 6
"""Pixels of a picture for each mm."""

UNSEEN, GROUND, TISSUE = (96, 100, 108), (16, 18, 22), (44, 46, 52)
"""Colours of mucosa that nobody saw, of the picture's ground, of tissue in slices."""

RAMP = ((64, 84, 160), (38, 140, 140), (110, 200, 90), (250, 230, 60))
"""Colours from a moment to `LONG_S`, of viridis: told apart by the colour-blind."""

LONG_S = 4.0
"""What was seen so long, or longer, has the last colour of the ramp."""

TURBINATES = ("inferior turbinate", "middle turbinate", "superior turbinate", "polyp")
SINUSES = (
    *("maxillary sinus", "frontal sinus", "anterior ethmoid", "posterior ethmoid"),
    *("sphenoid sinus", "variant cells"),
)

SLICES = ("middle turbinate head", "ethmoid bulla", "choana")
"""Landmarks through which the slices go, from the front to the back."""


@dataclass(frozen=True, slots=True)
class SessionCoverage:
    """What a recorded session saw of a head.

    watch: as at its end. distance: of the head before any cut. landmarks: by name.
    """

    watch: CoverageWatch
    distance: Volume
    landmarks: dict[str, Doubles]

    def picture(self) -> Pixels:
        """Return `coverage_picture` of the session."""
        return coverage_picture(self.watch, self.distance, self.landmarks)


def session_coverage(
    folder: StrPath,
    case: Path | None = None,
    progress: Progress = no_progress,
    patient: PatientScene | None = None,
) -> SessionCoverage:
    """Step a recorded session again and return what it saw.

    case: where the case that was flown through lies now. patient: the one that was
    flown through, where it is loaded already. UserError when the session cannot be
    read, was flown through another head, or nobody operated in it.
    """
    folder = Path(folder)
    recording = read_recording(folder)
    scenario = flown_scenario(folder, recording.info, case)
    patient = patient or load_patient(scenario, progress)
    _, session = reopen_session(folder, recording.info, patient)
    if session.coverage is None:
        raise UserError(f"{folder} is of a version that did not watch what is seen.")
    samples = [record.sample() for record in recording.samples]
    for place, sample in enumerate(samples):
        session.step(sample)
        progress("Stepping the session", (place + 1) / len(samples))
    distance = patient.surface.distance
    return SessionCoverage(session.coverage, distance, patient.landmarks)


def seconds_at(watch: CoverageWatch, places: Doubles, normals: Doubles) -> Doubles:
    """Return for how long places of the surface were in sight, s; NaN outside it.

    places, normals: ``(n, 3)`` LPS mm and unit into the air.
    """
    patch = watch.mucosa.patch_at(places, normals)
    if not len(watch.mucosa.area_mm2):
        return np.full(len(places), np.nan)
    return np.where(patch >= 0, watch.seconds[np.maximum(patch, 0)], np.nan)


def coverage_picture(
    watch: CoverageWatch, distance: Volume, landmarks: dict[str, Doubles]
) -> Pixels:
    """Return the opened nose from all sides, ``(h, w, 3)`` sRGB.

    Upper row: the lateral walls seen from the septum, and the septum's sides. Middle
    row: the walls without turbinates, and the sinuses seen from the middle. Lower row:
    slices from the front to the back. distance: signed, mm, negative in air.
    """
    mucosa = watch.mucosa
    site = np.array(mucosa.sites or ("",))[mucosa.site]
    base = np.array([name.partition(", ")[0] for name in site])
    is_left = np.char.endswith(site, "left")
    nose = ~np.isin(base, SINUSES)
    bare = nose & ~np.isin(base, TURBINATES)
    septum = base == "septum"
    middle = mucosa.places[septum, 0].mean() if septum.any() else 0.0
    # the olfactory cleft's and the choana's parts of it too
    septum = nose & (np.abs(mucosa.places[:, 0] - middle) < SEPTUM_MM)
    septum &= (mucosa.normals[:, 0] > 0.3) == is_left
    septum &= np.abs(mucosa.normals[:, 0]) > 0.3
    box = _box(mucosa.places)
    panels: list[list[Pixels]] = [[], []]
    titles: list[list[str]] = [[], []]
    for side, chosen in (("right", ~is_left), ("left", is_left)):
        for row, title, which in (
            (0, "lateral wall", nose & ~septum),
            (0, "septum", septum),
            (1, "without turbinates", bare & ~septum),
            (1, "sinuses", ~nose),
        ):
            # walls are seen from the middle, the septum from its side
            from_left = (side == "right") != (title == "septum")
            picture = _sagittal(watch, chosen & which, box, from_left)
            panels[row].append(picture)
            titles[row].append(f"{title}, {side}")
    rows = [_joined(_cropped(p), t) for p, t in zip(panels, titles, strict=True)]
    slices, names = [], []
    for name in SLICES:
        places = [landmarks.get(f"{name}, {side}") for side in ("right", "left")]
        known = [place for place in places if place is not None]
        if known:
            middle = np.mean(known, axis=0)
            slices.append(_slice(watch, distance, float(middle[1]), box))
            names.append(f"slice at {name}")
    if slices:
        rows.append(_joined(slices, names))
    width = max(row.shape[1] for row in rows)
    rows.append(_legend(width))
    padded = [
        np.pad(row, ((0, 0), (0, width - row.shape[1]), (0, 0)), constant_values=18)
        for row in rows
    ]
    return np.concatenate(padded)


def _box(places: Doubles) -> Doubles:
    """Return the lowest and highest place, ``(2, 3)``, with a margin."""
    if not len(places):
        return np.array([[0.0] * 3, [1.0] * 3])
    return np.array([places.min(axis=0) - 2.0, places.max(axis=0) + 2.0])


def _colours(seconds: Doubles, is_seen: NDArray[np.bool_]) -> Doubles:
    """Return colours ``(n, 3)``; what was in sight too shortly counts as unseen."""
    at = np.clip(seconds / LONG_S, 0.0, 1.0) * (len(RAMP) - 1)
    ramp = np.array(RAMP, np.float64)
    low = np.minimum(at.astype(np.intp), len(RAMP) - 2)
    mixed = ramp[low] + (at - low)[:, None] * (ramp[low + 1] - ramp[low])
    return np.where(is_seen[:, None], mixed, np.array(UNSEEN, np.float64))


def _sagittal(
    watch: CoverageWatch, chosen: NDArray[np.bool_], box: Doubles, from_left: bool
) -> Pixels:
    """Draw patches as discs, seen along x; the nearest is in front.

    from_left: the eye is on the patient's left, so the face looks to the left.
    """
    mucosa, facing = watch.mucosa, watch.mucosa.normals[:, 0]
    chosen = chosen & (((facing > -0.2) == from_left) | (np.abs(facing) < 0.2))
    places, normals = mucosa.places[chosen], mucosa.normals[chosen]
    size = np.ceil(SCALE * (box[1] - box[0])).astype(int)
    picture = PilImage.new("RGB", (int(size[1]), int(size[2])), GROUND)
    draw = ImageDraw.Draw(picture)
    across = places[:, 1] - box[0, 1] if from_left else box[1, 1] - places[:, 1]
    x, y = SCALE * across, SCALE * (box[1, 2] - places[:, 2])
    light = 0.45 + 0.55 * np.abs(normals[:, 0])
    colours = _colours(watch.seconds[chosen], watch.seen[chosen])
    colours = (colours * light[:, None]).astype(int)
    radius = SCALE * np.sqrt(np.maximum(mucosa.area_mm2[chosen], 0.5) / np.pi) * 1.25
    order = np.argsort(places[:, 0] if from_left else -places[:, 0], kind="stable")
    for n in order.tolist():
        r = radius[n]
        corners = (x[n] - r, y[n] - r, x[n] + r, y[n] + r)
        draw.ellipse(corners, fill=tuple(colours[n].tolist()))
    return np.asarray(picture)


def _slice(watch: CoverageWatch, distance: Volume, y_mm: float, box: Doubles) -> Pixels:
    """Draw a coronal slice, the patient's right on the left: walls by what was seen."""
    size = np.ceil(SCALE * (box[1] - box[0])).astype(int)
    x = box[0, 0] + (np.arange(size[0]) + 0.5) / SCALE
    z = box[1, 2] - (np.arange(size[2]) + 0.5) / SCALE
    grid = np.empty((len(z), len(x), 3))
    grid[..., 0], grid[..., 1], grid[..., 2] = x, y_mm, z[:, None]
    places = grid.reshape(-1, 3)
    values = distance.sample(places)
    colours = np.where(values[:, None] < 0.0, GROUND, TISSUE).astype(np.float64)
    # a line of 0.7 mm in tissue along the wall
    wall = np.flatnonzero((values >= 0.0) & (values < 0.7))
    step = 0.5 * float(distance.spacing_mm.min())
    around = step * np.eye(3)
    slope = distance.sample(places[wall, None] + around)
    slope -= distance.sample(places[wall, None] - around)
    normals = -slope / np.maximum(np.linalg.norm(slope, axis=1), 1e-9)[:, None]
    feet = places[wall] + values[wall, None] * normals
    patch = watch.mucosa.patch_at(feet, normals)
    at, patch = wall[patch >= 0], patch[patch >= 0]
    colours[at] = _colours(watch.seconds[patch], watch.seen[patch])
    return colours.astype(np.uint8).reshape(len(z), len(x), 3)


def _cropped(panels: Sequence[Pixels]) -> list[Pixels]:
    """Return panels of one height without the rows that none of them uses."""
    used = np.concatenate(panels, axis=1) != np.array(GROUND, np.uint8)
    rows = np.flatnonzero(used.any(axis=(1, 2)))
    if not len(rows):
        return list(panels)
    low, high = max(int(rows[0]) - SCALE, 0), int(rows[-1]) + SCALE
    return [panel[low:high] for panel in panels]


def _joined(panels: Sequence[Pixels], titles: Sequence[str]) -> Pixels:
    """Join panels of one height, each with its title above it."""
    titled = []
    for panel, title in zip(panels, titles, strict=True):
        head = PilImage.new("RGB", (panel.shape[1], 22), GROUND)
        ImageDraw.Draw(head).text((6, 4), title, fill=(225, 228, 232), font_size=14)
        titled.append(np.concatenate([np.asarray(head), panel]))
    return np.concatenate(titled, axis=1)


def _legend(width: int) -> Pixels:
    """Draw what the colours mean."""
    picture = PilImage.new("RGB", (width, 34), GROUND)
    draw = ImageDraw.Draw(picture)
    draw.rectangle((10, 9, 40, 24), fill=UNSEEN)
    ink = (225, 228, 232)
    draw.text((48, 8), "not seen", fill=ink, font_size=14)
    seconds = np.linspace(0.0, LONG_S, 200)
    ramp = _colours(seconds, np.ones(200, np.bool_)).astype(int)
    for n, colour in enumerate(ramp.tolist()):
        draw.line((140 + n, 9, 140 + n, 24), fill=tuple(colour))
    draw.text((348, 8), f"seen, up to {LONG_S:g} s and more", fill=ink, font_size=14)
    return np.asarray(picture)
