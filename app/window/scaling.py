"""Lengths that grow with the window, said once where a page is laid out.

A layout keeps its designed margins and gaps, and a part its designed sizes; whoever
scales a page asks all that lie in it.
"""

from typing import TypeVar

from PySide6.QtWidgets import QFormLayout, QGridLayout, QLayout, QWidget

_L = TypeVar("_L", bound=QLayout)
_MARGINS, _GAPS, _LENGTHS = "designed margins", "designed gaps", "designed lengths"


class Scaled:
    """Something in a window that paints, or does more than `lay` and `hold` say."""

    scale = 1.0
    """Factor on every font and length; 1 is the designed size."""

    def take_scale(self) -> None:
        """Do what depends on the scale, beside painting."""


def lay(layout: _L, *margins: int, gap: int | tuple[int, int] | None = None) -> _L:
    """Give a layout designed lengths, and return it.

    margins: left, top, right and bottom, or one for all of them. gap: between parts; of
    a grid or form across and down, or one for both.
    """
    if margins:
        layout.setProperty(_MARGINS, list(margins * (4 // len(margins))))
    if gap is not None:
        layout.setProperty(_GAPS, list(gap if isinstance(gap, tuple) else (gap, gap)))
    _scale_layout(layout, 1.0)
    return layout


def hold(part: QWidget, **lengths: int) -> None:
    """Give a part designed lengths, by the names of Qt's setters of them."""
    part.setProperty(_LENGTHS, lengths)
    _scale_part(part, 1.0)


def scale_all(root: QWidget, scale: float) -> None:
    """Scale all that lies in a part, itself included."""
    for layout in root.findChildren(QLayout):
        _scale_layout(layout, scale)
    for part in (root, *root.findChildren(QWidget)):
        _scale_part(part, scale)
        if isinstance(part, Scaled):
            part.scale = scale
            part.take_scale()
            part.update()


def _scale_layout(layout: QLayout, scale: float) -> None:
    if (margins := layout.property(_MARGINS)) is not None:
        layout.setContentsMargins(*(round(margin * scale) for margin in margins))
    if (gaps := layout.property(_GAPS)) is not None:
        across, down = (round(gap * scale) for gap in gaps)
        if isinstance(layout, QGridLayout | QFormLayout):
            layout.setHorizontalSpacing(across)
            layout.setVerticalSpacing(down)
        else:
            layout.setSpacing(across)


def _scale_part(part: QWidget, scale: float) -> None:
    for setter, length in (part.property(_LENGTHS) or {}).items():
        getattr(part, setter)(round(length * scale))
