"""A result's card never reaches beyond the picture that it is painted over."""

import pytest

from tests.app.window.opened_window import run_script

CARDS = """
from PySide6.QtCore import QRect, QRectF
from PySide6.QtGui import QGuiApplication
from app.window.panels.result_card import SMALLEST, ResultCard
from paravol.flight_events import FlightEnd

class Told(FlightEnd):
    def rows(self):
        return told

application = QGuiApplication([])
end = Told("The flight is over", None)
injury = "2.1 mm deep at 4.8 s, right, through the thin bone, by the upturned forceps"
for room, scale in ((QRect(0, 0, 795, 594), 1.0), (QRect(0, 0, 1190, 940), 1.5)):
    for count in (0, 5, 25, 40, 300):
        told = [(f"injury: orbit {n}", injury) for n in range(count)]
        card = ResultCard.fitting(room, end, scale)
        assert QRectF(room).contains(card.box), (room, count, card.box)
        assert SMALLEST * scale <= card.scale <= scale
        if card.rows == told:
            continue
        # it is full, and says how much is missing
        assert card.scale == SMALLEST * scale and count > 5
        *kept, (_, said) = card.rows
        assert kept == told[: len(kept)]
        assert said.startswith(f"{count - len(kept)} more rows")
        assert room.height() - card.box.height() < 60 * scale
print("well")
"""


@pytest.mark.display
def test_many_injuries_are_cut_short_and_told_of(screen: str) -> None:
    assert run_script(CARDS) == "well\n"
