"""Print the figures of ``docs/anatomy.md``, measured anew.

    python examples/measure_anatomy.py --seeds 200 --spacing 1.2

``--seeds``: how many drawn heads, seeds 0 upwards; ``--spacing``: their voxels, mm. The
default head is measured at 0.5 mm, its ways at 0.35 and 0.25 mm. Takes about a second a
drawn head. How it is measured: the modules in
``benchmarks/phantom_figures/``; the tests use the same. Times and memory are
measured by ``paravol bench --suite anatomy``.
"""

import argparse
import sys

import numpy as np

from anatomy import PhantomParameters, build_phantom, draw_parameters
from benchmarks.phantom_figures.passage_widths import (
    cell_diameters_mm,
    entrance_radii_mm,
    half_head,
    nearest_mm,
    ostium_diameters_mm,
)
from benchmarks.phantom_figures.sinus_volumes import (
    SIDES,
    SINUSES,
    anterior_share,
    leaks,
    sinus_volumes_ml,
    spine_distances_mm,
    surface_errors_mm,
)
from benchmarks.phantom_figures.wall_peaks import lamina_peaks, septa_head, septum_peaks

DEFAULT = PhantomParameters()
SEPTA_SEEDS = range(1, 9)


def main() -> None:
    """Measure the default head, its ways and walls, then drawn heads."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=200, help="drawn heads")
    parser.add_argument("--spacing", type=float, default=1.2, help="their voxels, mm")
    chosen = parser.parse_args()
    if chosen.seeds < 1:
        parser.error(f"--seeds must be at least 1, got {chosen.seeds}")
    default_head()
    ways()
    walls()
    drawn_heads(chosen.seeds, chosen.spacing)


def default_head() -> None:
    """Print volumes, distances and surface errors of the default head."""
    for spacing in (1.0, 0.5):
        phantom = build_phantom(DEFAULT, spacing)
        errors = 1e3 * surface_errors_mm(phantom)
        print(
            f"surface error at {spacing} mm: median {np.median(errors):.1f} um, "
            f"90 % {np.percentile(errors, 90):.0f} um"
        )
    print(f"default head at 0.5 mm, leaks: {leaks(phantom) or 'none'}")
    for side in SIDES:
        volumes = sinus_volumes_ml(phantom, side)
        line = ", ".join(f"{name} {ml:.1f} mL" for name, ml in volumes.items())
        share = 100 * anterior_share(phantom, side)
        print(f"  {side.name.lower()}: {line}, anterior {share:.0f} %")
    for place, mm in spine_distances_mm(DEFAULT).items():
        print(f"  spine to {place}: {mm:.1f} mm")


def ways() -> None:
    """Print what passes where in the default head."""
    for side in SIDES:
        half = half_head(DEFAULT, side)
        print(f"ways on the {side.name.lower()}, voxels of {half.spacing_mm} mm:")
        for what, found in (
            ("ball radius", entrance_radii_mm(half, side)),
            ("diameter", ostium_diameters_mm(half, side)),
        ):
            print(
                f"  {what}: " + ", ".join(f"{k} {r:.1f} mm" for k, r in found.items())
            )
        cells = cell_diameters_mm(DEFAULT, side)
        print(f"  ethmoid cells: {min(cells):.1f} to {max(cells):.1f} mm (0.25 mm)")
        for ball, ostium in (4.0, "maxillary"), (4.0, "sphenoid"), (2.7, "sphenoid"):
            near = nearest_mm(half, side, ostium, ball)
            print(f"  a {ball} mm ball comes to {near:.1f} mm of the {ostium} ostium")


def walls() -> None:
    """Print peaks of thin walls under a standard kernel, slices of 4 mm."""
    medians = []
    for seed in SEPTA_SEEDS:
        head = PhantomParameters(seed=seed, edge_blur_mm=0.6, mucosa_mm=0.3)
        medians.append(float(np.median(septum_peaks(septa_head(head)))))
    print(
        f"ethmoid septa, {len(medians)} seeds: medians of {min(medians):.0f} to "
        f"{max(medians):.0f} HU, their mean {np.mean(medians):.0f} HU"
    )
    for side in SIDES:
        peaks = lamina_peaks(side)
        print(f"lamina, {side.name.lower()}: median {np.median(peaks):.0f} HU")


def drawn_heads(seeds: int, spacing_mm: float) -> None:
    """Print means, standard deviations and ranges over drawn heads, both sides."""
    volumes, shares, distances = [], [], []
    for seed in range(seeds):
        parameters = draw_parameters(seed)
        phantom = build_phantom(parameters, spacing_mm)
        for side in SIDES:
            volumes.append([*sinus_volumes_ml(phantom, side).values()])
            shares.append(100 * anterior_share(phantom, side))
        distances.append([*spine_distances_mm(parameters).values()])
        print(f"\r{seed + 1} of {seeds} heads", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    print(f"{seeds} drawn heads at {spacing_mm} mm, both sides:")
    for name, ml in zip(SINUSES, np.transpose(volumes), strict=True):
        print(f"  {name}: {ml.mean():.1f} ± {ml.std():.1f} mL")
    print(f"  anterior share: {np.mean(shares):.0f} ± {np.std(shares):.0f} %")
    for name, mm in zip(
        spine_distances_mm(DEFAULT), np.transpose(distances), strict=True
    ):
        print(f"  spine to {name}: {mm.min():.1f} to {mm.max():.1f} mm")


if __name__ == "__main__":
    main()
