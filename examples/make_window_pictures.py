"""Make ``docs/pictures/window_*.png``: the pages of the window, and the instructor's.

    python examples/make_window_pictures.py
    python examples/make_window_pictures.py --references

The window's pages are those that the test's trainee comes along
(`tests/app/window/journey.py`), on a virtual screen (Debian: xvfb). A Chromium without
a window draws the instructor's page (chromium-headless-shell). ``--references`` renews
the small pictures that the test compares with instead: look at them before you keep
them.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from urllib.request import urlopen

from PIL import Image

ROOT = Path(__file__).parents[1]
PICTURES = ROOT / "docs" / "pictures"
PAGES = "home", "flight", "result", "compared", "volume", "connection"
SCREEN = ["xvfb-run", "-a", "-s", "-screen 0 3840x2160x24 -nolisten tcp"]
WALK = ["-m", "pytest", "-q", "-p", "pytestqt.plugin", "-p", "no:cacheprovider", "-s"]
JOURNEY = "tests/app/window/journey.py"
BROWSER = "chromium-headless-shell"
FLIGHT_S, MOMENT_S = 25, 12.0


def walk(**told: str) -> None:
    """Go the whole way through the window, and its environment told so."""
    # the page of results tells where a flight is recorded
    place = Path(tempfile.gettempdir()) / "paravol"
    command = [*SCREEN, sys.executable, *WALK, "--timeout=900", JOURNEY]
    command += [f"--basetemp={place}"]
    environment = os.environ | told | {"QT_QPA_PLATFORM": "xcb"}
    subprocess.run(command, cwd=ROOT, env=environment, check=True)


def draw_instructors_page(drawn: Path) -> None:
    """Fly the bundled operation, and have a browser draw what an instructor sees.

    A browser that draws to a file waits for the end of what it loads, and the page's
    streams have none: it gets one moment of both.
    """
    command = [*SCREEN, sys.executable, "-m", "app", "train", "--no-store"]
    command += [
        "--scenario",
        "first_operation",
        "--input",
        "emulator",
        "--sound",
        "off",
    ]
    command += ["--instructor-page", "0", "--seconds", str(FLIGHT_S), "--size", "512"]
    with (
        tempfile.TemporaryDirectory() as folder,
        subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as child,
    ):
        assert child.stdout is not None
        line = next(line for line in child.stdout if "http://" in line)
        page = moment_of(line.split()[-1], Path(folder))
        subprocess.run(
            [
                *(BROWSER, "--no-sandbox", "--disable-gpu", "--hide-scrollbars"),
                *(f"--user-data-dir={folder}/profile", f"--screenshot={drawn}"),
                *("--window-size=1280,720", page.as_uri()),
            ],
            check=True,
            capture_output=True,
        )
        child.communicate()


def moment_of(address: str, folder: Path) -> Path:
    """Keep the page with one state and one picture; return its file."""
    with urlopen(f"{address}states") as states:
        lines = (line.decode() for line in states if line.startswith(b"data: "))
        told = (line.removeprefix("data: ") for line in lines)
        state = next(t for t in told if json.loads(t).get("clock_s", 0.0) > MOMENT_S)
    for name in ("picture.jpg", "instructor.js", "instructor.css"):
        with urlopen(f"{address}{name}") as file:
            (folder / name).write_bytes(file.read())
    with urlopen(address) as file:
        text = file.read().decode().replace('src="pictures"', 'src="picture.jpg"')
    told_once = f"setTimeout(() => this.onmessage({{data: {json.dumps(state)}}}))"
    stub = f"window.EventSource = class {{ constructor() {{ {told_once} }} }}"
    page = folder / "page.html"
    page.write_text(text.replace("<head>", f"<head><script>{stub}</script>", 1))
    return page


def keep(drawn: Path, name: str) -> None:
    """Keep a picture, with as many colours as a small file has room for."""
    file = PICTURES / f"window_{name}.png"
    with Image.open(drawn) as image:
        image.convert("RGB").quantize(256).save(file, optimize=True)
    print(f"{file}: {file.stat().st_size / 1e3:.0f} kB")


def main() -> None:
    """Make the pictures of the documents, or those of the test."""
    if "--references" in sys.argv[1:]:
        walk(JOURNEY_RENEW="1")
        return
    with tempfile.TemporaryDirectory() as folder:
        walk(JOURNEY_PICTURES=folder)
        for page in PAGES:
            keep(Path(folder) / f"{page}-1280.png", page)
        drawn = Path(folder) / "instructor.png"
        draw_instructors_page(drawn)
        keep(drawn, "instructor")


if __name__ == "__main__":
    main()
