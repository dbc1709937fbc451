"""The trainee's window, opened on a virtual screen by the command itself."""

import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageColor

from app.vtk.overview_scene import LIGHT
from devices.openigtlink import PoseStreamer
from scenarios.bundle import FrameRecord, SampleRecord, read_session
from tests.app.window.opened_window import LIMIT_S, ROOT, run_script
from tests.slow_cases import slow

pytestmark = pytest.mark.display

Train = Callable[..., tuple[subprocess.CompletedProcess[str], list[int]]]
LIGHT_RGB = ImageColor.getrgb(LIGHT)


def parts(screenshot: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cut the endoscope's picture and the overview out of a window's picture."""
    with Image.open(screenshot) as picture:
        pixels = np.asarray(picture.convert("RGB"), dtype=np.float64)
    height, width = pixels.shape[:2]
    endoscope = pixels[height // 4 : height * 5 // 8, width // 6 : width * 4 // 10]
    overview = pixels[height // 4 : height * 3 // 4, width * 2 // 3 : width - 20]
    return endoscope, overview


@pytest.mark.parametrize("hand", ["mouse", *slow("emulator")])
def test_the_window_flies_records_and_closes_by_itself(
    train: Train, coarse_scenario: Path, tmp_path: Path, hand: str
) -> None:
    shot, bundle = tmp_path / "shot.png", tmp_path / "flight.paravol"
    done, left = train(
        *("--scenario", str(coarse_scenario), "--seconds", "8"),
        *("--input", hand, "--screenshot", str(shot), "--record", str(bundle)),
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert not left
    endoscope, overview = parts(shot)
    red, green, blue = endoscope.mean(axis=(0, 1))
    assert red > 40
    assert red > 1.2 * green
    assert red > 1.2 * blue
    assert endoscope.std() > 5  # a view of something, not a plain colour
    # the head's red shows on the overview's dark ground
    head = (overview[..., 0] > 1.4 * overview[..., 1]) & (overview[..., 0] > 60)
    assert 0.05 < head.mean() < 0.8
    # and so does the tip of the scope, which is drawn without shading
    tip = np.abs(overview - np.array(LIGHT_RGB)).max(axis=-1) < 8
    assert 30 < tip.sum() < 3000
    _, records, complete = read_session(bundle)
    assert complete
    assert (bundle / "result.json").is_file()
    frames = [record for record in records if isinstance(record, FrameRecord)]
    assert [frame.number for frame in frames] == list(range(len(frames)))
    assert frames


KEYS = """
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from tests.app.window.opened_window import OpenedWindow

opened = OpenedWindow("first_flight", "emulator")
flight, window, page, Key = opened.flight, opened.window, opened.page, Qt.Key
for key, degrees in (
    (Key.Key_Right, 5), (Key.Key_Up, 10), (Key.Key_Left, 5), (Key.Key_Down, 0)
):
    QTest.keyClick(page, key)
    assert flight.flight.scope.post_deg == degrees, (key, flight.flight.scope.post_deg)
before = window.geometry()
for leave in (Key.Key_F, Key.Key_Escape):
    QTest.keyClick(page, Key.Key_F)
    assert window.isFullScreen()
    assert window.geometry() == window.screen().geometry() != before
    QTest.keyClick(page, leave)
    assert not window.isFullScreen()
    assert window.geometry() == before
for key in (Key.Key_Q, Key.Key_Escape):
    window.show()
    QTest.keyClick(page, key)
    assert not window.isVisible()
window.release()
"""


@pytest.mark.slow
def test_keys_turn_the_light_fill_the_screen_and_quit(screen: str) -> None:
    run_script(KEYS)


STEER = """
import sys
import numpy as np
from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtTest import QTest
from tests.app.window.opened_window import OpenedWindow

opened = OpenedWindow(sys.argv[1])
window, page, until = opened.window, opened.page, opened.until
def pose(index):
    return opened.seen[index].view.world_from_tip

opened.start()
pivot, axis = pose(-1)[:3, 3], -pose(-1)[:3, 2]
assert all(np.array_equal(pose(n), pose(0)) for n in range(len(opened.seen)))
QTest.keyPress(page, Qt.Key.Key_W)
until("depth", lambda: np.linalg.norm(pose(-1)[:3, 3] - pivot) > 10.0)
QTest.keyRelease(page, Qt.Key.Key_W)
QTest.mousePress(page.picture, Qt.MouseButton.LeftButton, pos=QPoint(100, 100))
QTest.mouseMove(page.picture, QPoint(100, 40))
QTest.mouseRelease(page.picture, Qt.MouseButton.LeftButton, pos=QPoint(100, 40))
until("tilt", lambda: -pose(-1)[:3, 2] @ axis < np.cos(np.radians(2.0)))
assert -pose(-1)[2, 2] > axis[2]  # dragged up, it points up
# Keys that are down when the window loses the keyboard do not stick.
QTest.keyPress(page, Qt.Key.Key_S)
opened.application.sendEvent(window, QEvent(QEvent.Type.WindowDeactivate))
until("a halt", lambda: np.array_equal(pose(-1), pose(-2)))
depth = np.linalg.norm(pose(-1)[:3, 3] - pivot)
assert depth > 5.0, depth
# The head is opened in a thread of its own, while the scope flies on.
# It is made beside the flight, as the overview is.
until("a head", lambda: page._overview._head is not None)
page._overview.finish()
overview = page._overview.scene
assert not overview.is_open
QTest.keyClick(page, Qt.Key.Key_C)
until("an open head", lambda: overview.is_open)
QTest.keyClick(page, Qt.Key.Key_C)
until("a whole head", lambda: not overview.is_open)
# Walls push the shaft aside, and the nostril gives way: by .11 mm here.
poses = [instant.view.world_from_tip for instant in opened.seen]
off = [np.linalg.norm(np.cross(f[:3, 3] - pivot, f[:3, 2])) for f in poses]
assert max(off) < 0.3, max(off)
opened.close()
"""


@pytest.mark.slow
def test_keys_and_mouse_steer_the_scope_about_the_nostril(
    screen: str, coarse_scenario: Path
) -> None:
    run_script(STEER, coarse_scenario)


@pytest.mark.slow
def test_one_program_flies_what_another_streams(
    train: Train, coarse_scenario: Path, tmp_path: Path
) -> None:
    bundle = tmp_path / "linked.paravol"
    pose = np.eye(4)
    pose[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]  # looks backwards: +y, LPS
    pose[:3, 3] = -6.3, -13.0, -6.5
    over = threading.Event()
    with PoseStreamer(0) as streamer:

        def stream() -> None:
            while not over.wait(0.01):
                streamer.publish("Stylus", pose, time.monotonic())

        sender = threading.Thread(target=stream)
        sender.start()
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        try:
            done, left = train(
                *("--scenario", str(coarse_scenario), "--seconds", "1"),
                *("--input", f"igtl:127.0.0.1:{streamer.port}"),
                *("--stream-igtl", str(port), "--record", str(bundle)),
            )
        finally:
            over.set()
            sender.join()
    assert (done.returncode, done.stderr) == (0, "")
    assert not left
    _, records, complete = read_session(bundle)
    samples = [record for record in records if isinstance(record, SampleRecord)]
    assert complete
    expected = pose.astype(np.float32).astype(np.float64).ravel().tolist()
    assert samples
    assert all(sample.device_from_tip == expected for sample in samples)


@pytest.mark.slow
def test_ctrl_c_closes_the_window(
    screen: str, family: Any, coarse_scenario: Path
) -> None:
    command = [sys.executable, "-m", "app", "train", "--scenario", str(coarse_scenario)]
    command += ["--input", "emulator"]
    with subprocess.Popen(
        command,
        cwd=ROOT,
        env=family.environment,
        stderr=subprocess.PIPE,
        text=True,
    ) as child:
        # The flight has begun when the emulated arm runs beside the window.
        while child.poll() is None and not has_emulator(family):
            time.sleep(0.1)
        child.send_signal(signal.SIGINT)
        _, said = child.communicate(timeout=LIMIT_S)
    assert child.returncode == 130
    assert "Traceback" not in said
    # The emulated arm looks twice a second whether its parent still lives.
    until = time.monotonic() + 10.0
    while family.pids() and time.monotonic() < until:
        time.sleep(0.1)
    assert not family.pids()


def has_emulator(family: Any) -> bool:
    for pid in family.pids():
        try:
            words = Path(f"/proc/{pid}/cmdline").read_bytes()
        except OSError:
            continue
        if b"devices.microscribe.emulator.process" in words:
            return True
    return False
