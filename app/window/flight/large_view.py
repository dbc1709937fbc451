"""Which view has the page's large place: the scope's picture, slices or overview."""

from PySide6.QtWidgets import QVBoxLayout, QWidget

from app.window.flight.side_panel import SideColumn
from app.window.texts import later


class LargeView:
    """Let views change places: one is large, the scope's picture then stands aside."""

    def __init__(self, place: QVBoxLayout, picture: QWidget, side: SideColumn) -> None:
        """Take the layout that has the picture, and the column with the others."""
        self._place = place
        self._picture = picture
        self._side = side
        self._views = {
            later("The scope's picture"): picture,
            later("Slices"): side.slices,
            later("Overview"): side.overview,
        }
        self.name = "The scope's picture"

    def next(self) -> str:
        """Make the next view large; gives its name."""
        names = list(self._views)
        return self.show(names[(names.index(self.name) + 1) % len(names)])

    def show(self, name: str) -> str:
        """Make a view large; gives its name."""
        if name == self.name:
            return name
        before, self.name = self._views[self.name], name
        view = self._views[name]
        self._swap(before, self._picture)
        self._swap(self._picture, view)
        self._side.slices.set_large(view is self._side.slices)
        return name

    def _swap(self, large: QWidget, small: QWidget) -> None:
        """Exchange the large view and one of the column."""
        if large is small:
            return
        held = QWidget(large.parentWidget())
        self._place.replaceWidget(large, held)
        self._side.replace(small, large)
        self._place.replaceWidget(held, small)
        self._place.setStretchFactor(small, 1)
        held.hide()
        held.deleteLater()
