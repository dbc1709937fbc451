import numpy as np
import pytest
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QImage, QPainter
from PySide6.QtWidgets import QApplication

from app.window.panels.guide_marks import say_beside

EDGE, LOW, SIDE = 600, 150, 300


BITE = "mucosa 12, uncinate 9, turbinate bone 4, polyp 3, middle turbinate 2 mm3"


@pytest.mark.parametrize(
    "words", ["polyp, right", "no way there: move the scope", BITE]
)
@pytest.mark.parametrize("x", [0.0, 0.4, 0.5, 0.6, 1.0])
@pytest.mark.parametrize("y", [0.0, 0.5, 1.0])
def test_words_stand_in_the_picture_and_not_on_their_place(
    application: QApplication, words: str, x: float, y: float
) -> None:
    image = QImage(EDGE, EDGE, QImage.Format.Format_RGB32)
    image.fill(Qt.GlobalColor.white)
    painter = QPainter(image)
    square = QRectF(LOW, LOW, SIDE, SIDE)
    place = QPointF(LOW + x * SIDE, LOW + y * SIDE)
    say_beside(painter, square, place, words, 1.0, 14.0)
    painter.end()
    grey = image.convertToFormat(QImage.Format.Format_Grayscale8)
    shown = np.frombuffer(grey.constBits(), np.uint8).reshape(EDGE, EDGE) < 200
    rows, columns = np.nonzero(shown)
    for places in (rows, columns):
        assert places.min() >= LOW - 1
        assert places.max() <= LOW + SIDE + 1
    away = np.hypot(rows - place.y(), columns - place.x())
    assert away.min() > 10.0
