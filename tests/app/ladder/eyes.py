"""What somebody before the window sees, a quarter of a second ago.

Only what is on the screen: texts of labels that are visible, and what the picture is
told to paint. Nothing of the flight itself.
"""

import math
import re
import time
from collections import deque
from dataclasses import dataclass, field

from PySide6.QtCore import QObject, QTimer
from PySide6.QtWidgets import QLabel, QProgressBar, QWidget

from app.window.main_window import MainWindow
from app.window.panels.endoscope_panel import PictureView
from app.window.panels.gauges import Gauges
from app.window.panels.task_panel import TaskPanel
from app.window.panels.touch_bars import TouchBars

REACTION_S = 0.25
LOOKED_MS = 25


@dataclass(frozen=True)
class Mark:
    """The guide's mark: its words, its distance, its place over the picture.

    Out of the round picture there is only an arrow: its place is at the rim. back_mm:
    it says that one must draw back so far first. has_no_way: that the tool in hand does
    not get there.
    """

    words: str
    mm: float
    x: float
    y: float
    is_goal: bool
    is_in: bool
    back_mm: float
    has_no_way: bool


@dataclass(frozen=True)
class Sight:
    """What was seen at one moment.

    pictures: so many the scope's picture has had. task: the words of the task to be
    done now; done: what stands above it. bar: its progress, 0 to 1. heading: where the
    shaft goes, in shares; None for the middle. up: where the patient's top is, a unit
    vector, x right, y down. said: over the picture. alarm: at its rim. bite: what it
    says beside the tool that this would take, mm3 by tissue. hazard_mm: the nearest.
    names: of what is seen, and where. tip: the ring of the tool.
    """

    at_s: float
    page: str = ""
    pictures: int = 0
    task: str = ""
    done: str = ""
    bar: float = 0.0
    mark: Mark | None = None
    heading: tuple[float, float] | None = None
    up: tuple[float, float] | None = None
    said: str = ""
    alarm: str = ""
    touching: str = ""
    tool: str = ""
    bite: dict[str, float] = field(default_factory=dict)
    hazard_mm: float = math.inf
    names: tuple[tuple[str, float, float], ...] = ()
    tip: tuple[float, float] | None = None
    gauges: dict[str, str] = field(default_factory=dict)


class Eyes(QObject):
    """Look at a window all the time; give what was seen a reaction ago."""

    def __init__(self, window: MainWindow) -> None:
        super().__init__()
        self._window = window
        self._seen: deque[Sight] = deque([Sight(0.0)], maxlen=400)
        self._pictures = 0
        self._watched: PictureView | None = None
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._look)
        self._timer.start(LOOKED_MS)

    @property
    def sight(self) -> Sight:
        """Return what has come to mind: what was there a reaction ago."""
        now_s = time.monotonic() - REACTION_S
        found = self._seen[0]
        for sight in reversed(self._seen):
            if sight.at_s <= now_s:
                found = sight
                break
        return found

    def texts(self) -> list[str]:
        """Return the words of all labels that can be seen."""
        labels = self._window.findChildren(QLabel)
        return [label.text() for label in labels if label.isVisible() and label.text()]

    def _look(self) -> None:
        page = self._window.page
        picture = page.findChild(PictureView)
        now_s = time.monotonic()
        if picture is None or not picture.isVisible():
            self._seen.append(Sight(now_s, type(page).__name__))
            return
        if picture is not self._watched:
            self._watched, self._pictures = picture, 0
            picture.changed.connect(self._count)
        tasks = page.findChild(TaskPanel)
        gauges = page.findChild(Gauges)
        tool = page.findChild(QLabel, "tool")
        bars = page.findChild(TouchBars)
        letters = [letter for letter in picture._letters if "S" in letter.letters]
        self._seen.append(
            Sight(
                now_s,
                type(page).__name__,
                self._pictures,
                *_task(tasks),
                _mark(picture),
                picture._heading,
                (letters[0].x, letters[0].y) if letters else None,
                f"{picture._message}: {picture._detail}",
                picture._alarm,
                picture._touched,
                "" if tool is None else tool.text(),
                _bite(picture._tip_words),
                _hazard_mm(bars),
                tuple((name.name, name.x, name.y) for name in picture._names),
                picture._tip,
                {} if gauges is None else _figures(gauges),
            )
        )

    def _count(self) -> None:
        self._pictures += 1


def _task(panel: TaskPanel | None) -> tuple[str, str, float]:
    """Return the words of the first task, what is done, and the first bar."""
    if panel is None or not panel.isVisible():
        return "", "", 0.0
    lines = [w for w in panel.findChildren(QLabel, "task") if w.isVisible()]
    counts = [w for w in panel.findChildren(QLabel, "caption") if w.isVisible()]
    bars = [w for w in panel.findChildren(QProgressBar) if w.isVisible()]
    return (
        lines[0].text() if lines else "",
        counts[0].text() if counts else "",
        bars[0].value() / 100.0 if bars else 0.0,
    )


def _bite(words: str) -> dict[str, float]:
    """Read "uncinate 12 mm³, mucosa < 1 mm³"; of less than 1 a third is thought."""
    read = re.findall(r"([^,]+?) (< )?(\d+) mm³", words)
    return {n.strip(): float(mm3) / (3.0 if less else 1.0) for n, less, mm3 in read}


def _hazard_mm(bars: TouchBars | None) -> float:
    """Read "Hazard 3.5 mm to nasolacrimal duct"; infinite where there is none."""
    words = "" if bars is None else bars.accessibleName()
    read = re.search(r"Hazard.*?(-?[\d.]+) mm", words)
    return math.inf if read is None else float(read[1])


def _mark(picture: PictureView) -> Mark | None:
    guide = picture.guide
    if guide is None:
        return None
    # as it is painted: "12 mm"
    number = re.match(r"\d+", guide.text())
    back = re.search(r"draw back (\d+) mm", guide.text())
    x, y = guide.x - 0.5, guide.y - 0.5
    away = (x * x + y * y) ** 0.5
    if away > 0.5:
        x, y = 0.5 * x / away, 0.5 * y / away
    return Mark(
        guide.what if guide.is_goal else "",
        float(number[0]) if number else 0.0,
        0.5 + x,
        0.5 + y,
        guide.is_goal,
        guide.is_in_picture,
        float(back[1]) if back else 0.0,
        "no way for the tool" in guide.text(),
    )


def _figures(gauges: QWidget) -> dict[str, str]:
    labels = [w for w in gauges.findChildren(QLabel) if w.isVisible()]
    names = [w.text() for w in labels if w.objectName() == "caption"]
    figures = [w.text() for w in labels if w.objectName() == "figure"]
    return dict(zip(names, figures, strict=False))
