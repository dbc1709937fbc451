"""Compare our light from wall to wall with Mitsuba's, in the gallery's twelve views.

    python examples/make_light_witness.py

Needs Mitsuba, see docs/light.md. Prints the table that stands there and makes
``docs/pictures/light_witness.png``: in each row ours, then Mitsuba's by its own way and
with paths that leave walls as ours do, either with the difference of the red light,
blue where theirs is darker. Takes ten to twenty minutes.
"""

from contextlib import closing
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from app.cli.terminal import Stages
from benchmarks.gallery.gallery_views import gallery_scene, gallery_views
from benchmarks.gallery.scope_studio import surface_of
from benchmarks.light_witness import BOUNCES, Agreement, DiffuseRoom, Estimate
from benchmarks.peers.light_jobs import LightJobs, mitsuba_process
from renderers.scene import save_png
from renderers.shading.kernels.path_tracing import LIFTED_MM

SIZE = 32
SHOWN = ("turbinate", "ostium", "wound, nearer")
OWN_BATCHES = 64
PASSES, PATHS = 16, 64
WAYS = {"Mitsuba, own way": None, "off walls as ours": LIFTED_MM}
PANEL = 160
BAND_PX = 22
FULL_SCALE = 0.25
"""Difference over the mean light that is shown as full red or blue."""
GAMMA = 2.2
TARGET = Path(__file__).parents[1] / "docs" / "pictures" / "light_witness.png"
Picture = NDArray[np.float64]


def main() -> None:
    """Compare all views; write the picture."""
    lines = [
        f"| view | straight | {' | '.join(WAYS)} |",
        "| --- | ---: | ---: | ---: |",
    ]
    rows: list[list[tuple[str, NDArray[np.uint8]]]] = []
    views = gallery_views(SIZE)
    with closing(mitsuba_process()) as peer, Stages() as stages:
        for done, view in enumerate(views):
            stages("Light from wall to wall", done / len(views))
            room = DiffuseRoom(view, surface_of(gallery_scene(view.head)))
            jobs = LightJobs(peer, room.surface.distance, room.albedo)
            own, _ = room.bounced(OWN_BATCHES)
            straight = ask(jobs, room, bounced_only=False).mean.mean()
            away = straight / room.straight().mean.mean() - 1
            cells = [view.name, f"{100 * away:+.2f} %"]
            exposure = np.quantile(own.mean, 0.98)
            row = [(f"{view.name}: ours", lit(own.mean / exposure))]
            for way, lifted_mm in WAYS.items():
                theirs = ask(jobs, room, lifted_mm=lifted_mm)
                found = Agreement.of(own, theirs, room.edges)
                cells.append(
                    f"{100 * found.mean:+.2f} +- {100 * found.mean_error:.2f} %"
                )
                row.append((way, lit(theirs.mean / exposure)))
                row.append(("difference", apart(own.mean, theirs.mean)))
            lines.append(f"| {' | '.join(cells)} |")
            if view.name in SHOWN:
                rows.append(row)
    print("\n".join(lines))
    save_png(TARGET, sheet(rows))


def ask(
    jobs: LightJobs,
    room: DiffuseRoom,
    *,
    bounced_only: bool = True,
    lifted_mm: float | None = None,
) -> Estimate:
    """Return what Mitsuba finds in independent passes."""
    job = jobs.job(
        room.camera,
        room.light,
        paths=PATHS,
        passes=PASSES,
        bounces=BOUNCES if bounced_only else 0,
        bounced_only=bounced_only,
        refined=2,
        lifted_mm=lifted_mm,
    )
    return Estimate.of_passes(jobs.passes(job)[0])


def sheet(rows: list[list[tuple[str, NDArray[np.uint8]]]]) -> NDArray[np.uint8]:
    """Put the panels side by side, each below its name."""
    size = (len(rows[0]) * PANEL, len(rows) * (PANEL + BAND_PX))
    whole = Image.new("RGB", size, "white")
    draw, font = ImageDraw.Draw(whole), ImageFont.load_default(13)
    for y, row in enumerate(rows):
        for x, (name, pixels) in enumerate(row):
            panel = Image.fromarray(pixels)
            panel = panel.resize((PANEL, PANEL), Image.Resampling.NEAREST)
            whole.paste(panel, (x * PANEL, y * (PANEL + BAND_PX) + BAND_PX))
            draw.text((x * PANEL + 4, y * (PANEL + BAND_PX) + 3), name, "black", font)
    return np.asarray(whole)


def lit(light: Picture) -> NDArray[np.uint8]:
    """Encode light of which 1 is white."""
    codes: NDArray[np.uint8] = np.rint(255 * np.clip(light, 0, 1) ** (1 / GAMMA))
    return codes.astype(np.uint8)


def apart(own: Picture, theirs: Picture) -> NDArray[np.uint8]:
    """Paint the difference of the red light: red where theirs is brighter."""
    share = (theirs - own)[..., 0] / (FULL_SCALE * own[..., 0].mean())
    share = np.clip(share, -1, 1)
    pale = 1 - np.abs(share)
    colours = np.stack(
        [np.where(share > 0, 1, pale), pale, np.where(share < 0, 1, pale)], axis=-1
    )
    return np.asarray(np.rint(255 * colours), np.uint8)


if __name__ == "__main__":
    main()
