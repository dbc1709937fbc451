"""Make ``docs/pictures/debrief.png``: parts of the demonstration's debrief.

    python examples/make_debrief_picture.py out/demo/debrief.html

A Chromium without a window draws the page (Debian: chromium-headless-shell).
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

PICTURE = Path(__file__).parents[1] / "docs" / "pictures" / "debrief.png"
WIDTH, HEIGHT = 1024, 9000
PARTS = "timeline", "hazards", "wounds"
"""Sections that are shown, one below the other."""

STYLE = """
<style>section, header, nav, footer { display: none }
%s { display: block } main { padding: 1rem }
.events li:nth-child(n + 7) { display: none } h2 { margin-top: 1rem }
#wounds ~ p { max-width: none } .pair { max-width: 40rem }</style></head>
"""


def main() -> None:
    """Draw the page's parts and cut off what is empty below them."""
    page = Path(sys.argv[1] if len(sys.argv) > 1 else "out/demo/debrief.html")
    names = filter(None, map(shutil.which, ("chromium-headless-shell", "chromium")))
    browser = next(names, None)
    if browser is None:
        raise SystemExit("There is no Chromium to draw the page with.")
    shown = ", ".join(f'section[aria-labelledby="{part}"]' for part in PARTS)
    text = page.read_text("utf-8").replace("</head>", STYLE % shown, 1)
    with tempfile.TemporaryDirectory() as folder:
        file, drawn = Path(folder) / "page.html", Path(folder) / "page.png"
        file.write_text(text, "utf-8")
        subprocess.run(
            [
                *(browser, "--no-sandbox", "--disable-gpu", "--hide-scrollbars"),
                *(f"--user-data-dir={folder}/profile", f"--screenshot={drawn}"),
                *(f"--window-size={WIDTH},{HEIGHT}", file.as_uri()),
            ],
            check=True,
            capture_output=True,
        )
        with Image.open(drawn) as image:
            whole = image.convert("RGB")
    # the page is white; what is not ends above this row
    inked = whole.convert("L").point(lambda level: 255 * (level < 250)).getbbox()
    assert inked is not None
    cut = whole.crop((0, 0, WIDTH, min(inked[3] + 16, HEIGHT)))
    cut.quantize(256).save(PICTURE, optimize=True)
    print(f"{PICTURE}: {PICTURE.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
