"""Make ``docs/pictures/light_witness.png``: our light from wall to wall, and Mitsuba's.

    python examples/make_light_witness.py

Needs Mitsuba, see docs/light.md. Each row is a view: ours, theirs, and the difference
of the red light, blue where theirs is darker. Prints the figures of the table there.
"""

from contextlib import closing
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from benchmarks.light_witness import BOUNCES, VIEWS, Agreement, DiffuseRoom, Estimate
from benchmarks.peers.light_jobs import LightJobs, mitsuba_process
from renderers.scene import save_png

SIZE = 48
PASSES = 32
PANEL = 240
BAND_PX = 22
FULL_SCALE = 0.25
"""Difference over the mean light that is shown as full red or blue."""
GAMMA = 2.2
TARGET = Path(__file__).parents[1] / "docs" / "pictures" / "light_witness.png"
Picture = NDArray[np.float64]


def main() -> None:
    """Compare both views; write the picture."""
    sheet = Image.new("RGB", (3 * PANEL, len(VIEWS) * (PANEL + BAND_PX)), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(13)
    with closing(mitsuba_process()) as peer:
        for row, name in enumerate(VIEWS):
            room = DiffuseRoom.at(name, SIZE)
            jobs = LightJobs(peer, room.surface.distance, room.albedo)
            theirs = Estimate.of_passes(ask(jobs, room, bounced_only=True))
            straight = Estimate.of_passes(ask(jobs, room, bounced_only=False))
            own, timing = room.bounced(PASSES)
            tell(name, own, theirs, room, timing.cpu_s)
            away = straight.mean.mean() / room.straight().mean.mean() - 1
            print(f"  straight from the scope {100 * away:+.2f} %")
            y = row * (PANEL + BAND_PX)
            exposure = np.quantile(own.mean, 0.98)
            panels = (
                ("ours", lit(own.mean / exposure)),
                ("Mitsuba 3.9.1", lit(theirs.mean / exposure)),
                (
                    f"difference, full colour {FULL_SCALE:.0%} of the mean",
                    apart(own.mean, theirs.mean),
                ),
            )
            for column, (text, pixels) in enumerate(panels):
                panel = Image.fromarray(pixels)
                panel = panel.resize((PANEL, PANEL), Image.Resampling.NEAREST)
                sheet.paste(panel, (column * PANEL, y + BAND_PX))
                at = (column * PANEL + 4, y + 3)
                draw.text(at, f"{name}: {text}" if not column else text, "black", font)
    save_png(TARGET, np.asarray(sheet))


def ask(
    jobs: LightJobs, room: DiffuseRoom, *, bounced_only: bool
) -> NDArray[np.float32]:
    """Return independent passes of Mitsuba."""
    job = jobs.job(
        room.camera,
        room.light,
        paths=64,
        passes=PASSES,
        bounces=BOUNCES if bounced_only else 0,
        bounced_only=bounced_only,
        refined=2,
    )
    return jobs.passes(job)[0]


def tell(
    name: str, own: Estimate, theirs: Estimate, room: DiffuseRoom, cpu_s: float
) -> None:
    """Print how the two agree."""
    found = Agreement.of(own, theirs, room.edges)
    print(f"{name}: {100 * found.mean:+.2f} +- {100 * found.mean_error:.2f} %")
    red = theirs.mean[..., 0].sum() / own.mean[..., 0].sum() - 1
    print(f"  red {100 * red:+.2f} %, beyond {100 * found.beyond:.2f} %")
    print(
        f"  noise ours {own.noise:.3f}, theirs {theirs.noise:.3f}; ours {cpu_s:.1f} s"
    )


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
