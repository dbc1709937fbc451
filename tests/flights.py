import os
import shutil
import subprocess
import sys
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from app.opengl import probe_window
from devices import ProbePath, load_probe_path, save_probe_path
from devices.registration.registration_file import RegistrationRecord, save_registration
from paravol.registration.at_start import head_of
from scenarios import load_scenario

FIRST_S, LAST_S = 8.0, 10.0
MARK = "PARAVOL_TEST_MARK"

Train = Callable[..., tuple[subprocess.CompletedProcess[str], list[int]]]


@pytest.fixture
def shifted_file(tmp_path: Path) -> Callable[[str], Path]:
    """Registers an arm by serial: shifts by (10, 20, 30), with a tip 14 mm longer."""

    def made(serial: str) -> Path:
        transform = np.eye(4)
        transform[:3, 3] = (10.0, 20.0, 30.0)
        file = tmp_path / "registration.json"
        record = RegistrationRecord(
            world_from_device=tuple(transform.ravel().tolist()),
            tip_mm=(0.0, 0.0, -14.0),
            arm_serial=serial,
            arm_model="DX",
            head=head_of(load_scenario("first_flight")[0]),
            created="2000-01-01T00:00:00+00:00",
            landmarks=(),
            residual_rms_mm=0.2,
            traced_points=0,
            surface_rms_mm=0.0,
            targets={},
            budget_mm=0.75,
        )
        save_registration(file, record)
        return file

    return made


@pytest.fixture(scope="session")
def coarse_scenario(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The whole bundled flight through a coarse head."""
    folder = tmp_path_factory.mktemp("coarse")
    _, bundled = load_scenario("first_flight")
    path = (bundled / "first_flight.path.json").read_bytes()
    (folder / "first_flight.path.json").write_bytes(path)
    text = (bundled / "first_flight.toml").read_text()
    coarse = text.replace("spacing_mm = 0.5", "spacing_mm = 1.0")
    (folder / "coarse.toml").write_text(coarse)
    return folder / "coarse.toml"


def part_of(
    whole: ProbePath,
    name: str,
    from_s: float,
    to_s: float,
    tools: tuple[tuple[float, str], ...] = (),
) -> ProbePath:
    """Return what a path does between two times; it begins at 0."""
    part = (whole.t_s >= from_s) & (whole.t_s <= to_s)
    times = whole.t_s[part]
    return ProbePath(
        name=name,
        t_s=np.round(times - times[0], 6),
        tip_mm=whole.tip_mm[part],
        axis=whole.axis[part],
        roll_deg=whole.roll_deg[part],
        instrument_tip_mm=whole.instrument_tip_mm[part],
        instrument_axis=whole.instrument_axis[part],
        buttons=whole.buttons[part],
        tools=tools,
        instrument_roll_deg=whole.instrument_roll_deg[part],
        jaw=whole.jaw[part],
    )


@pytest.fixture(scope="session")
def short_scenario(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two seconds of the bundled flight through a coarse head."""
    folder = tmp_path_factory.mktemp("scenario")
    scenario, bundled = load_scenario("first_flight")
    whole = load_probe_path(bundled / scenario.path)
    part = part_of(whole, "short", FIRST_S, LAST_S)
    save_probe_path(part, folder / "short.path.json")
    text = (bundled / "first_flight.toml").read_text()
    for old, new in (
        ('name = "first_flight"', 'name = "short"'),
        ("first_flight.path.json", "short.path.json"),
        ("spacing_mm = 0.5", "spacing_mm = 1.0"),
        ("time_s = 9.5", "time_s = 1.0"),
    ):
        assert old in text
        text = text.replace(old, new)
    # the later moments lie beyond these two seconds
    first, second, *_ = text.split("[[moments]]")
    (folder / "short.toml").write_text(f"{first}[[moments]]{second}")
    return folder / "short.toml"


@pytest.fixture(scope="module")
def screen() -> Iterator[str]:
    """A virtual screen on which OpenGL works, as DISPLAY."""
    with virtual_screen(1600, 1000) as display:
        yield display


@pytest.fixture
def screen_of(request: pytest.FixtureRequest) -> Iterator[tuple[int, int]]:
    """A virtual screen of so many pixels, given as parameter."""
    width, height = request.param
    with virtual_screen(width, height):
        yield width, height


@contextmanager
def virtual_screen(width: int, height: int) -> Iterator[str]:
    """Start a screen and set DISPLAY; skip the test where that cannot be done."""
    server = shutil.which("Xvfb")
    if server is None:
        pytest.skip("there is no Xvfb")
    reader, writer = os.pipe()
    command = [server, "-displayfd", str(writer), "-screen", "0"]
    command.append(f"{width}x{height}x24")
    with subprocess.Popen(
        [*command, "-nolisten", "tcp"], pass_fds=[writer], stderr=subprocess.DEVNULL
    ) as child:
        os.close(writer)
        with os.fdopen(reader) as told, pytest.MonkeyPatch.context() as patch:
            number = told.readline().strip()
            if not number:
                pytest.skip("Xvfb does not start")
            patch.setenv("DISPLAY", f":{number}")
            for name in ("WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
                patch.delenv(name, raising=False)
            graphics = probe_window()
            if not graphics.works:
                child.terminate()
                pytest.skip(graphics.problem)
            yield f":{number}"
        child.terminate()


class Family:
    """The processes below one, known by a mark that all of them inherit."""

    def __init__(self) -> None:
        self._mark = uuid.uuid4().hex

    @property
    def environment(self) -> dict[str, str]:
        """Get the present environment with the mark, for a child."""
        return os.environ | {MARK: self._mark}

    def pids(self) -> list[int]:
        """Find those that live, this process aside."""
        found = []
        for entry in Path("/proc").glob("[0-9]*"):
            try:
                environment = (entry / "environ").read_bytes()
            except OSError:
                continue
            if f"{MARK}={self._mark}".encode() in environment:
                found.append(int(entry.name))
        return found


@pytest.fixture
def family() -> Family:
    """A mark for the processes of this test."""
    return Family()


@pytest.fixture
def train(screen: str, family: Family) -> Train:
    """Run `paravol train` with these words; give what it said and who is left of it."""

    def run(*words: str) -> tuple[subprocess.CompletedProcess[str], list[int]]:
        done = subprocess.run(
            [sys.executable, "-m", "app", "train", "--size", "128", *words],
            cwd=Path(__file__).parents[1],
            env=family.environment,
            capture_output=True,
            text=True,
            timeout=240.0,
        )
        return done, family.pids()

    return run
