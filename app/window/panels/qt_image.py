"""Pictures on their way from arrays to Qt."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtGui import QImage


def image_of(pixels: NDArray[np.uint8]) -> QImage:
    """Return ``(h, w, 3)`` uint8 sRGB as an image that owns its memory."""
    height, width = pixels.shape[:2]
    borrowed = QImage(
        np.ascontiguousarray(pixels).data,
        width,
        height,
        3 * width,
        QImage.Format.Format_RGB888,
    )
    # Qt scales this format in two thirds of the time; the conversion copies
    return borrowed.convertToFormat(QImage.Format.Format_RGB32)
