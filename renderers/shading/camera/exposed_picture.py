"""A picture on its way: exposed, and developed by bands of rows."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from renderers.scene.thread_team import Errand
from renderers.shading.bands import RowBands

Result = TypeVar("Result")

OWN_SHARE = 0.25
"""Of the rows developed by the caller of `begin`: the others are done when it has begun
the next view and there is work for all threads again."""


@dataclass(frozen=True, slots=True)
class ExposedPicture:
    """Hold a picture that is still to be developed; before that none is exposed.

    pixels: ``(h, w, 3)`` uint8 sRGB, once all rows are done. develop: does the rows
    ``first..last``. least_rows: of a band, where a band of its own costs something.
    """

    pixels: NDArray[np.uint8]
    develop: Callable[[int, int], None]
    least_rows: int = 1

    def finish(self, bands: RowBands) -> NDArray[np.uint8]:
        """Develop it; give the pixels."""
        bands.run(len(self.pixels), self.develop, self.least_rows)
        return self.pixels

    def begin(
        self, bands: RowBands, then: Callable[[NDArray[np.uint8]], Result]
    ) -> Errand[Result]:
        """Leave most of the rows to one of the threads, which calls `then` at last."""
        height, team = len(self.pixels), bands.team
        own = round(OWN_SHARE * height) if team.threads > 1 else 0
        upper = team.errand(partial(self.develop, 0, own))

        def finish() -> Result:
            self.develop(own, height)
            upper.result()
            return then(self.pixels)

        finished = team.start(finish)
        upper.help()
        return finished
