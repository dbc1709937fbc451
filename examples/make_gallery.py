"""Make ``docs/gallery.md``: the same views by every mode, every light and every peer.

    python examples/make_gallery.py
    python examples/make_gallery.py --views choana recess --size 96 --out out/gallery

Writes ``gallery.md`` and a sheet for each family, ``pictures/gallery_*.png``, when all
is drawn: Ctrl-C before that leaves everything as it was. Takes some minutes on two
cores. Peers that are not installed are named in the page; docs/gallery.md says how to
have them.
"""

import argparse
import sys
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path

from app.cli.terminal import Stages
from benchmarks.gallery.classic_studio import LIT, SEE_THROUGH, ClassicStudio
from benchmarks.gallery.contact_sheet import Rows, contact_sheet
from benchmarks.gallery.gallery_page import gallery_page, picture_name
from benchmarks.gallery.gallery_views import gallery_scene, gallery_views
from benchmarks.gallery.light_studio import LightStudio
from benchmarks.gallery.panel import Family, Studio
from benchmarks.gallery.scope_studio import ScopeStudio
from benchmarks.gallery.witness_studio import WitnessStudio
from benchmarks.machine import machine
from benchmarks.nasal_views import NasalView
from disk import whole_file

DOCS = Path(__file__).parents[1] / "docs"
SIZE = 112
LEAST_SIZE, MOST_SIZE = 32, 512
PANEL_PX = 112
"""Pictures of another size are shown so wide."""


def main(words: list[str] | None = None) -> int:
    """Draw all families, then write; give the exit status."""
    names = [view.name for view in gallery_views(LEAST_SIZE)]
    parser = argparse.ArgumentParser(
        description=(__doc__ or "").splitlines()[0],
        epilog=f"Views: {', '.join(names)}.",
    )
    parser.add_argument(
        "--views", nargs="+", metavar="VIEW", default=names, help="by name; all"
    )
    parser.add_argument(
        "--size", type=int, default=SIZE, help=f"of each picture, pixels; {SIZE}"
    )
    parser.add_argument("--out", type=Path, default=DOCS, help="folder; docs")
    chosen = parser.parse_args(words)
    if unknown := sorted(set(chosen.views) - set(names)):
        parser.error(
            f"no view is called {unknown[0]!r}; choose from {', '.join(names)}"
        )
    if not LEAST_SIZE <= chosen.size <= MOST_SIZE or chosen.size % 2:
        parser.error(
            f"--size must be even, {LEAST_SIZE} to {MOST_SIZE}, got {chosen.size}"
        )
    views = [v for v in gallery_views(chosen.size) if v.name in chosen.views]
    where = machine()
    try:
        with Stages() as stages:
            sheets = drawn(views, stages)
    except KeyboardInterrupt:
        print("Stopped; nothing was written.", file=sys.stderr)
        return 130
    for family, rows in sheets.items():
        with whole_file(chosen.out / "pictures" / picture_name(family)) as path:
            contact_sheet(family, rows, PANEL_PX).save(path, "PNG", optimize=True)
    with whole_file(chosen.out / "gallery.md") as path:
        path.write_text(gallery_page(sheets, where, chosen.size), encoding="utf-8")
    print(chosen.out / "gallery.md")
    return 0


def drawn(views: list[NasalView], stages: Stages) -> dict[Family, Rows]:
    """Draw every view in every family, one family after the other."""
    heads = list(dict.fromkeys(view.head for view in views))
    for number, head in enumerate(heads):
        stages("Heads", number / len(heads))
        gallery_scene(head)
    stages("Heads", 1.0)
    studios: list[Callable[[], Studio]] = [
        ScopeStudio,
        LightStudio,
        partial(ClassicStudio, LIT),
        partial(ClassicStudio, SEE_THROUGH),
        WitnessStudio,
    ]
    # a head's pictures together: building what draws it takes longer than they do
    ordered = sorted(views, key=lambda view: heads.index(view.head))
    sheets: dict[Family, Rows] = {}
    for make in studios:
        with closing(make()) as studio:
            title = studio.family.title
            made = {}
            for number, view in enumerate(ordered):
                stages(title, number / len(ordered))
                made[view.name] = studio.draw(view)
            stages(title, 1.0)
            sheets[studio.family] = {view.name: made[view.name] for view in views}
    return sheets


if __name__ == "__main__":
    sys.exit(main())
