"""Which OpenGL this machine offers, asked in a child process.

Where the graphics libraries are missing, creating a window does not raise an error: it
ends the process, by a segmentation fault in VTK or an abort in Qt. Only a child can
find out safely. It reports each step on its standard output before it dares it.
"""

import ctypes
import hashlib
import importlib
import importlib.util
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import msgspec

from system import use_c_numbers, whole_file
from system.typed_record import read_kept

PATIENCE_S = 60.0
"""A cold disk needs several seconds to load the libraries for the first time."""

SOFTWARE_RENDERERS = ("llvmpipe", "softpipe", "swrast", "swiftshader", "software")

OFFSCREEN_LIBRARIES = {"libEGL.so.1": "libegl1"}
"""Shared library to Debian package: what VTK opens to draw without a display."""

WINDOW_LIBRARIES = {
    "libEGL.so.1": "libegl1",
    "libGL.so.1": "libgl1",
    "libdbus-1.so.3": "libdbus-1-3",
    "libfontconfig.so.1": "libfontconfig1",
    "libglib-2.0.so.0": "libglib2.0-0",
    "libxkbcommon.so.0": "libxkbcommon0",
    "libxkbcommon-x11.so.0": "libxkbcommon-x11-0",
    "libX11-xcb.so.1": "libx11-xcb1",
    "libxcb-cursor.so.0": "libxcb-cursor0",
    "libxcb-icccm.so.4": "libxcb-icccm4",
    "libxcb-keysyms.so.1": "libxcb-keysyms1",
    "libxcb-randr.so.0": "libxcb-randr0",
    "libxcb-shape.so.0": "libxcb-shape0",
    "libxcb-xkb.so.1": "libxcb-xkb1",
}
"""Shared library to Debian package: what Qt and its X11 plug-in are linked to."""

DRIVER_PACKAGE = "libgl1-mesa-dri"
"""Draws in software where there is no graphics card."""


@dataclass(frozen=True, slots=True)
class OpenGL:
    """Report what a trial found.

    vendor, renderer, version: as the driver names itself, empty without one.
    problem: why it cannot be used, one sentence; empty when it can.
    packages: Debian packages that are missing.
    """

    vendor: str = ""
    renderer: str = ""
    version: str = ""
    problem: str = ""
    packages: tuple[str, ...] = ()

    @property
    def works(self) -> bool:
        """Tell whether a picture can be drawn."""
        return not self.problem

    @property
    def is_software(self) -> bool:
        """Tell whether the processor does the graphics card's work."""
        name = self.renderer.lower()
        return any(part in name for part in SOFTWARE_RENDERERS)


def probe_offscreen() -> OpenGL:
    """Try VTK's off-screen OpenGL; takes about two seconds."""
    with _child("offscreen") as child:
        found, died = _answer(child)
    if died is None:
        return _described(found)
    packages = tuple(found.get("missing", ())) or (DRIVER_PACKAGE,)
    return OpenGL(
        problem=f"OpenGL cannot be used ({died}); on Debian, "
        f"apt install {' '.join(packages)} brings it.",
        packages=packages,
    )


def probe_window() -> OpenGL:
    """Try what the window needs: Qt on the present display, VTK beside it."""
    with window_trial() as answer:
        return answer()


@contextmanager
def window_trial() -> Iterator[Callable[[], OpenGL]]:
    """Begin what `probe_window` does; what is given waits for its end.

    The child takes a second or two, in which the program can load what needs no Qt.
    """
    if importlib.util.find_spec("PySide6") is None:
        problem = (
            "The window needs PySide6; install the extra 'desktop' "
            "(pip install 'paravol-ess[desktop]')."
        )
        yield lambda: OpenGL(problem=problem)
        return
    with _child("window") as child:
        yield lambda: _judged(*_answer(child))


@contextmanager
def remembered_trial() -> Iterator[Callable[[], OpenGL]]:
    """Do what `window_trial` does, unless the last window here came to its end.

    What was found is remembered from the end of a window to the beginning of the next:
    after one that died, drivers are tried anew.
    """
    entry = _memory()
    known = read_kept(entry, OpenGL)
    with suppress(OSError):
        entry.unlink()
    if known is not None and known.works:
        found = known
        yield lambda: found
    else:
        with window_trial() as answer:
            asked = cache(answer)
            yield asked
            found = asked()
    if found.works:
        with suppress(OSError), whole_file(entry) as beside:
            beside.write_bytes(msgspec.json.encode(found))


def _memory() -> Path:
    """Return the file for this display, this machine since it was started, and VTK."""
    from platformdirs import user_cache_path

    booted = Path("/proc/sys/kernel/random/boot_id")
    since = booted.read_bytes() if booted.exists() else b""
    built = [importlib.util.find_spec(name) for name in ("vtkmodules", "PySide6")]
    told = [str(each and each.origin) for each in built]
    ways = [os.environ.get(n) for n in ("QT_QPA_PLATFORM", "LD_LIBRARY_PATH")]
    words = repr([display_name(), *told, *ways]).encode() + since
    name = hashlib.sha256(words).hexdigest()[:16]
    return user_cache_path("paravol", appauthor=False) / "opengl" / f"{name}.json"


def _judged(found: dict[str, str], died: str | None) -> OpenGL:
    """Return what a trial of the window found, or why none can open."""
    if died is None:
        return _described(found)
    reasons = []
    display = display_name()
    packages = tuple(found.get("missing", ()))
    if display is None:
        reasons.append(
            "there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set; "
            "`paravol demo` needs none)"
        )
    if packages:
        reasons.append(
            "libraries are missing, which on Debian come with apt install "
            f"{' '.join(packages)}"
        )
    if not reasons and found.get("step") == "display":
        reasons.append(f"the display {display} cannot be reached")
    if not reasons:
        packages = (DRIVER_PACKAGE,)
        reasons.append(
            f"OpenGL does not start on the display {display} ({died}); on Debian, "
            f"apt install {DRIVER_PACKAGE} brings a driver"
        )
    return OpenGL(
        problem=f"The window cannot open: {'; and '.join(reasons)}.", packages=packages
    )


def display_name() -> str | None:
    """Give the display a window would open on; None without one."""
    if not sys.platform.startswith("linux"):
        return "of this desktop"
    for name in ("WAYLAND_DISPLAY", "DISPLAY"):
        if os.environ.get(name):
            return os.environ[name]
    # Qt draws on these platforms without any display.
    if os.environ.get("QT_QPA_PLATFORM", "").partition(":")[0] == "offscreen":
        return "offscreen"
    return None


def _described(found: dict[str, str]) -> OpenGL:
    return OpenGL(found["vendor"], found["renderer"], found["version"])


@contextmanager
def _child(kind: str) -> "Iterator[subprocess.Popen[str]]":
    """Run this file in a child; it ends with the block."""
    with subprocess.Popen(
        [sys.executable, "-m", "app.opengl", kind],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
    ) as child:
        try:
            yield child
        finally:
            child.kill()


def _answer(child: "subprocess.Popen[str]") -> tuple[dict[str, str], str | None]:
    """Give what a child reported and how it failed, if so."""
    try:
        said, _ = child.communicate(timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        return {}, f"a trial did not end within {PATIENCE_S:g} seconds"
    found: dict[str, str] = {}
    for line in said.splitlines():
        # Drivers print here as well.
        if line.startswith("{"):
            found.update(json.loads(line))
    if child.returncode == 0 and "version" in found:
        return found, None
    if child.returncode < 0:
        return found, f"a trial ended with signal {-child.returncode}"
    return found, found.get("error", f"a trial ended with status {child.returncode}")


def _report(**found: object) -> None:
    print(json.dumps(found), flush=True)


def _missing(libraries: dict[str, str]) -> list[str]:
    packages = []
    for library, package in libraries.items():
        try:
            ctypes.CDLL(library)
        except OSError:
            packages.append(package)
    return packages


def _try_offscreen() -> None:
    from vtkmodules.vtkRenderingCore import vtkRenderWindow

    # Loading it is what gives VTK its OpenGL classes.
    importlib.import_module("vtkmodules.vtkRenderingOpenGL2")
    window = vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetSize(16, 16)
    window.Render()
    described = dict(
        line.split(" string:", 1)
        for line in window.ReportCapabilities().splitlines()
        if " string:" in line
    )
    _report(
        vendor=described["OpenGL vendor"].strip(),
        renderer=described["OpenGL renderer"].strip(),
        version=described["OpenGL version"].strip(),
    )


def _try_window() -> None:
    from PySide6.QtGui import QGuiApplication

    if display_name() is None:
        raise RuntimeError("there is no display")
    _report(step="display")
    application = QGuiApplication(["paravol"])
    use_c_numbers()
    _report(step="context")
    _try_offscreen()
    application.quit()


def _try(kind: str) -> int:
    libraries = WINDOW_LIBRARIES if kind == "window" else OFFSCREEN_LIBRARIES
    if sys.platform.startswith("linux"):
        _report(missing=_missing(libraries))
    try:
        if kind == "window":
            _try_window()
        else:
            _try_offscreen()
    except (ImportError, RuntimeError) as error:
        _report(error=str(error))
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(_try(sys.argv[1]))
