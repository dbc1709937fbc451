"""The window where the decimal is a comma."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from paravol.patient import load_case
from scenarios.bundle import SampleRecord, read_session
from tests.app.window.opened_window import LIMIT_S, ROOT
from tests.comma_locale import abroad, germany
from tests.slow_cases import slow

__all__ = ["germany"]

OPENED = """
import locale, sys
from PySide6.QtWidgets import QApplication
from app.window.application import make_application
application = QApplication([]) if sys.argv[1] == "Qt's" else make_application()
print(locale.localeconv()["decimal_point"])
"""

LEFT = """
import sys, threading
from PySide6.QtWidgets import QApplication, QWidget
from app.window.application import make_application
application = QApplication([]) if sys.argv[1] == "Qt's" else make_application()
here = threading.get_ident()

class Part(QWidget):
    def __del__(self):
        print("here" if threading.get_ident() == here else "elsewhere")
        application.quit()

part = Part()
part.itself = part
del part
allocates = lambda: [[n] for n in range(100_000)]
elsewhere = threading.Thread(target=allocates)
elsewhere.start()
elsewhere.join()
if sys.argv[1] != "Qt's":
    application.exec()
"""


@pytest.mark.parametrize(("whose", "where"), [("Qt's", "elsewhere"), ("ours", "here")])
def test_widgets_on_cycles_end_in_the_windows_thread(whose: str, where: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", LEFT, whose],
        env=os.environ | {"QT_QPA_PLATFORM": "offscreen"},
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
    )
    assert (done.returncode, done.stdout.strip()) == (0, where), done.stderr


@pytest.mark.parametrize(("whose", "point"), [("Qt's", ","), ("ours", ".")])
@pytest.mark.parametrize("name", ["LC_ALL", *slow("LANG", "LC_NUMERIC")])
def test_libraries_keep_the_point_that_qt_takes_away(
    whose: str, point: str, name: str, germany: dict[str, str]
) -> None:
    said = germany | {"LANG": "C.UTF-8", name: germany["LANG"]}
    said["QT_QPA_PLATFORM"] = "offscreen"
    done = subprocess.run(
        [sys.executable, "-c", OPENED, whose],
        env=abroad(said),
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.strip() == point


def test_no_other_module_makes_an_application() -> None:
    """The trial of OpenGL has a process of its own, which reads no file."""
    made = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "app").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id.endswith("Application")
    }
    assert made == {"app/opengl.py", "app/window/application.py"}


@pytest.mark.display
@pytest.mark.timeout(500)
def test_a_case_is_flown_as_it_was_made_where_the_decimal_is_a_comma(
    screen: str, tmp_path: Path, germany: dict[str, str]
) -> None:
    case, bundle = tmp_path / "case", tmp_path / "flight.paravol"

    def run(*words: object) -> str:
        done = subprocess.run(
            [sys.executable, "-m", "app", *map(str, words)],
            env=abroad(germany),
            cwd=ROOT,
            capture_output=True,
            text=True,
            timeout=LIMIT_S,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stderr

    run("phantom", "--seed", 7, "--spacing", 2.5, "--average", "--out", case)
    flown = ("--size", 64, "--sound", "off", "--no-store", "--seconds", 1)
    assert run("train", "--case", case, *flown, "--record", bundle) == ""
    info, records, is_complete = read_session(bundle)
    there = load_case(case)
    assert is_complete
    assert [r for r in records if isinstance(r, SampleRecord)]
    # of all distances to the bit, and of where they lie
    assert info.surface_sha256 == there.surface_sha256
    assert there.surface.distance.spacing_mm.tolist() == [2.5] * 3
