"""Commands of the slices."""

from collections.abc import Callable
from functools import partial

from app.window.keyboard.actions import Act
from app.window.keyboard.page_commands import Command, Commands, Notify
from app.window.panels.slices_panel import SlicesView
from app.window.texts import tr

WINDOW_STEP_HU = 50.0
PLACE_STEP = 2.0
"""Voxels of a key that moves the place."""


def slice_commands(slices: SlicesView, notify: Notify) -> Commands:
    """Return what can be done with the slices."""

    def grey(wider_hu: float, brighter_hu: float) -> None:
        notify(slices.change_window(wider_hu, brighter_hu), "")

    def again(do: Callable[..., object], *how: float) -> Command:
        return Command(partial(do, *how), repeats=True)

    return {
        Act.IMAGING: Command(lambda: notify(slices.switch(), tr("Slices at the tip"))),
        Act.FOLLOW: Command(lambda: notify(slices.switch_following(), slices.info)),
        Act.PLANE: Command(
            lambda: notify(slices.next_plane(), tr("Keys go through these slices."))
        ),
        Act.WINDOW: Command(lambda: notify(slices.next_window(), "")),
        Act.SLICE_AHEAD: again(slices.step, 1),
        Act.SLICE_BACK: again(slices.step, -1),
        Act.NARROW: again(grey, -WINDOW_STEP_HU, 0.0),
        Act.WIDE: again(grey, WINDOW_STEP_HU, 0.0),
        Act.BRIGHTER: again(grey, 0.0, WINDOW_STEP_HU / 2),
        Act.DARKER: again(grey, 0.0, -WINDOW_STEP_HU / 2),
        Act.PLACE_LEFT: again(slices.nudge, -PLACE_STEP, 0.0),
        Act.PLACE_RIGHT: again(slices.nudge, PLACE_STEP, 0.0),
        Act.PLACE_UP: again(slices.nudge, 0.0, -PLACE_STEP),
        Act.PLACE_DOWN: again(slices.nudge, 0.0, PLACE_STEP),
    }
