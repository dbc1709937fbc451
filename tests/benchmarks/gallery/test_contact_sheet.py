"""Every panel stands on the sheet, in its place."""

import numpy as np

from benchmarks.gallery.contact_sheet import (
    GAP_PX,
    HEAD_PX,
    LINE_PX,
    NAME_PX,
    contact_sheet,
    spent,
)
from benchmarks.gallery.panel import Absent, Family, Panel

SIDE = 40
FAMILY = Family("test", "Test", ("one", "two", "three"), "r", "u", "t")


def flat(who: str, colour: tuple[int, int, int], cpu_s: float | None = 0.01) -> Panel:
    pixels = np.full((SIDE, SIDE, 3), colour, np.uint8)
    return Panel(who, pixels, cpu_s, 0.5, 0.9, "" if cpu_s else "wrong")


def test_panels_stand_in_rows_of_views_and_columns() -> None:
    red, green, blue = (200, 0, 0), (0, 200, 0), (0, 0, 200)
    rows: dict[str, list[Panel | Absent]] = {
        "first": [flat("one", red), flat("two", green), Absent("three", "none")],
        "second": [flat("one", blue, None), flat("two", red), flat("three", green)],
    }
    sheet = np.asarray(contact_sheet(FAMILY, rows, SIDE).convert("RGB")).astype(int)
    for line, panels in enumerate(rows.values()):
        for number, panel in enumerate(panels):
            top = HEAD_PX + line * (SIDE + 2 * LINE_PX + GAP_PX)
            left = NAME_PX + number * (SIDE + GAP_PX)
            inner = sheet[top + 2 : top + SIDE - 2, left + 2 : left + SIDE - 2]
            if isinstance(panel, Absent):
                assert inner.max() > 100  # the word
                assert np.median(inner) < 30
            else:
                assert np.abs(inner - panel.pixels[2:-2, 2:-2]).max() < 6
    # the one that is not right has a frame
    frame = sheet[HEAD_PX + SIDE + 2 * LINE_PX + GAP_PX, NAME_PX : NAME_PX + SIDE]
    assert frame[:, 0].min() > 150


def test_pictures_of_another_size_are_fitted() -> None:
    small = Panel("one", np.full((8, 8, 3), 150, np.uint8), 1.0, 0.0, 1.0)
    sheet = contact_sheet(FAMILY, {"first": [small]}, SIDE).convert("RGB")
    middle = np.asarray(sheet)[HEAD_PX : HEAD_PX + SIDE, NAME_PX : NAME_PX + SIDE]
    assert np.abs(middle.astype(int) - 150).max() < 6


def test_what_is_not_right_has_no_time() -> None:
    assert spent(None) == "not right"
    assert spent(0.0123) == "12.3 ms"
