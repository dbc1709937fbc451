"""What only POSIX has is asked for in named modules, and the rest goes without.

No other system was there to try: these tests hide from our modules what it would lack.
"""

import ast
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests import flights
from tests.hidden_posix import MODULES, NAMES, ROOT

coarse_scenario = flights.coarse_scenario
screen = flights.screen

WHERE = {
    "system/file_lock.py",
    "system/processes.py",
    "system/resources.py",
    "system/typed_text.py",
    "devices/controls/linux_input.py",
    "devices/controls/rumble.py",
    "devices/serial_adapters.py",
    "devices/microscribe/emulator/terminal_port.py",
    "devices/microscribe/wire/terminal_file.py",
}
"""Each says what happens elsewhere: another way, or a sentence that says what lacks."""

PRODUCT = (
    *("anatomy", "app", "devices", "system", "paravol", "renderers"),
    *("scenarios", "surgery"),
)
SOURCES = sorted(path for name in PRODUCT for path in (ROOT / name).rglob("*.py"))


PARTS = frozenset(("start_new_session", "preexec_fn", "pass_fds"))
SUSPECT = re.compile("|".join((*MODULES, *PARTS, *frozenset().union(*NAMES.values()))))


def needs(path: Path) -> tuple[str, ...]:
    """Return what a file names that other systems lack, with its lines."""
    text = path.read_text(encoding="utf-8")
    if not SUSPECT.search(text):
        return ()
    tree = ast.parse(text)
    found = []
    for node in ast.walk(tree):
        match node:
            case ast.Import(names=names):
                asked = [alias.name for alias in names]
            case ast.ImportFrom(module=str(module), names=names):
                asked = [module, *(f"{module}.{alias.name}" for alias in names)]
            case ast.Attribute(value=ast.Name(id=module), attr=name):
                asked = [f"{module}.{name}"]
            case ast.keyword(arg=str(word)) if word in PARTS:
                asked = ["os.fork"]
            case _:
                continue
        for words in asked:
            top, _, name = words.partition(".")
            if top in MODULES or name in NAMES.get(top, ()):
                found.append(f"{path.relative_to(ROOT)}:{words}")
    return tuple(found)


def test_only_named_modules_need_posix() -> None:
    places = {path.relative_to(ROOT).as_posix(): needs(path) for path in SOURCES}
    assert not [n for file, names in places.items() if file not in WHERE for n in names]
    assert {file for file in WHERE if not (ROOT / file).is_file()} == set()


def test_children_of_this_program_are_spawned() -> None:
    """A fork exists on POSIX only, and shares the locks of compiled threads."""
    for path in SOURCES:
        text = path.read_text(encoding="utf-8")
        if "multiprocessing" in text or "ProcessPoolExecutor" in text:
            assert 'get_context("spawn")' in text, path


HOOK = f"""
import runpy
runpy.run_path({str(ROOT / "tests" / "hidden_posix.py")!r})["hide"]()
"""


def run_hidden(
    tmp_path: Path, *words: str, patience_s: float = 60.0
) -> subprocess.CompletedProcess[str]:
    """Run Python on these words where our modules find no POSIX, children included."""
    place = tmp_path / "hook"
    place.mkdir()
    (place / "sitecustomize.py").write_text(HOOK)
    found = os.pathsep.join((str(place), str(ROOT)))
    return subprocess.run(
        [sys.executable, *words],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": found},
        capture_output=True,
        text=True,
        timeout=patience_s,
    )


IMPORT_ALL = """
import importlib, pathlib, sys
import paravol.inputs, scenarios
failed = {}
try:
    import system.typed_text, os
    import devices.serial_adapters
    devices.serial_adapters.os.openpty
except AttributeError:
    print("hidden")
for file in sys.argv[1:]:
    name = file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    importlib.import_module(name)
print("imported")
"""


@pytest.mark.slow
def test_every_module_can_be_imported_without_posix(tmp_path: Path) -> None:
    files = [
        path.relative_to(ROOT).as_posix()
        for path in SOURCES
        if "__main__" not in path.name
        and "kernels" not in path.parts
        and path.relative_to(ROOT).as_posix() != "renderers/art/ranks/mpi.py"
    ]
    done = run_hidden(tmp_path, "-c", IMPORT_ALL, *files, patience_s=200.0)
    assert (done.returncode, done.stdout) == (0, "hidden\nimported\n"), done.stderr


def test_the_command_runs_without_make_and_posix(tmp_path: Path) -> None:
    done = run_hidden(tmp_path, "-m", "app", "--help")
    assert done.returncode == 0, done.stderr
    assert "Start with: paravol demo" in done.stdout


@pytest.mark.slow
def test_mouse_and_emulated_arm_are_flown_without_posix(
    tmp_path: Path, coarse_scenario: Path
) -> None:
    script = str(ROOT / "tests" / "flown_without_posix.py")
    words = script, str(coarse_scenario), str(tmp_path / "store")
    done = run_hidden(tmp_path, *words, patience_s=280.0)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["port"].startswith("socket://127.0.0.1:")
    for flight in told["flights"].values():
        assert flight["frames"] > 5
        assert flight["moved_mm"] > 0.0
        assert flight["duration_s"] > 0.0
        assert (Path(flight["record"]) / "result.json").is_file()
    # it was touched at the fiducials, through the port
    assert 0.0 < told["flights"]["emulator"]["residual_mm"] < 1.0


@pytest.mark.display
@pytest.mark.slow
def test_the_window_is_flown_by_mouse_without_posix(
    tmp_path: Path, screen: str, coarse_scenario: Path
) -> None:
    words = ["-m", "app", "train", "--scenario", str(coarse_scenario), "--size", "64"]
    words += ["--seconds", "2", "--no-store", "--sound", "off"]
    done = run_hidden(tmp_path, *words, patience_s=280.0)
    assert (done.returncode, done.stderr) == (0, "")
    assert "path length" in done.stdout
