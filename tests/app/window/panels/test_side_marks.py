"""The mark of where the shaft goes."""

import numpy as np
import pytest
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QImage, QPainter
from PySide6.QtWidgets import QApplication

from app.window.panels.side_marks import paint_heading

EDGE = 400


def painted(place: tuple[float, float]) -> np.ndarray:
    """Which pixels (rows, columns) the mark lights up."""
    image = QImage(EDGE, EDGE, QImage.Format.Format_RGB32)
    image.fill(Qt.GlobalColor.black)
    painter = QPainter(image)
    paint_heading(painter, QRectF(0, 0, EDGE, EDGE), place, 1.0)
    painter.end()
    grey = image.convertToFormat(QImage.Format.Format_Grayscale8)
    lit = np.frombuffer(grey.constBits(), np.uint8).reshape(EDGE, EDGE) > 100
    return np.argwhere(lit)


@pytest.mark.parametrize("place", [(0.5, 0.875), (0.2, 0.4)])
def test_in_view_it_rings_the_place(
    application: QApplication, place: tuple[float, float]
) -> None:
    lit = painted(place)
    assert len(lit) > 30
    middle = (lit.max(axis=0) + lit.min(axis=0)) / 2.0 / EDGE
    assert middle[::-1] == pytest.approx(place, abs=0.01)


def test_out_of_view_an_arrow_points_to_it_from_the_rim(
    application: QApplication,
) -> None:
    lit = painted((0.5, 1.3))
    rows, columns = lit.T
    assert columns.mean() == pytest.approx(EDGE / 2, abs=1.5)
    assert 0.9 * EDGE < rows.min() < rows.max() < EDGE
    # the point of the arrow is its lowest part
    lowest = columns[rows == rows.max()]
    assert lowest.mean() == pytest.approx(EDGE / 2, abs=2.0)
