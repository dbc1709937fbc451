"""The window fits a small screen and uses a large one."""

import json

import pytest

from tests.app.window.opened_window import run_script

pytestmark = [pytest.mark.display, pytest.mark.slow]

MEASURE = """
import json
import numpy as np
from PySide6.QtWidgets import QLabel
from paravol.snapshots.snapshot_queue import MomentPicture
from tests.app.window.flight.test_flight_page import faults
from tests.app.window.opened_window import OpenedWindow

opened = OpenedWindow("first_flight", size=64)
window, application, page = opened.window, opened.application, opened.page
# with all that the column ever holds
page._moments.show_moment(MomentPicture(1.0, np.zeros((64, 64, 3), np.uint8), 0.5))
application.processEvents()
screen = window.screen().availableGeometry()
found = faults(page)
# and all keys over it
page.switch_help()
application.processEvents()
found += faults(page._help)
labels = [label for label in window.findChildren(QLabel) if label.isVisible()]
figure = next(label for label in labels if label.objectName() == "figure")
print(json.dumps({
    "window": [window.width(), window.height()],
    "screen": [screen.width(), screen.height()],
    "faults": found,
    "labels": len(labels),
    "text": figure.fontInfo().pixelSize(),
    "slices": page._slices.height(),
}))
window.shut()
window.release()
"""


@pytest.mark.parametrize(
    "screen_of", [(1024, 768), (1280, 720), (1920, 1080), (3840, 2160)], indirect=True
)
def test_everything_lies_on_the_screen_and_grows_with_it(
    screen_of: tuple[int, int],
) -> None:
    found = json.loads(run_script(MEASURE))
    width, height = found["window"]
    assert found["screen"] == list(screen_of)
    assert width <= screen_of[0]
    assert height <= screen_of[1]
    assert found["labels"] > 20
    assert found["faults"] == []
    # a text is a fortieth of the window's height or so, on every screen
    assert 0.02 < found["text"] / height < 0.045
    # three share the width beside picture and buttons: 99 of 728 at 1,024 x 768, the
    # narrowest; more than .14 on all others
    assert found["slices"] > (0.14 if width > 1024 else 0.13) * height
