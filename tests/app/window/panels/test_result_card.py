"""A result's card never reaches beyond the picture that it is painted over."""

from dataclasses import dataclass

import pytest
from PySide6.QtCore import QRect, QRectF
from PySide6.QtWidgets import QApplication

from app.window.panels.result_card import SMALLEST, ResultCard
from paravol.flight.flight_events import FlightEnd
from scenarios import Score

INJURY = "2.1 mm deep at 4.8 s, right, through the thin bone, by the upturned forceps"


@dataclass(frozen=True)
class Hurt(FlightEnd):
    """An end of so many injuries, and nothing else."""

    count: int = 0

    def rows(self) -> list[tuple[str, str]]:
        return [(f"injury: orbit {n}", INJURY) for n in range(self.count)]


@pytest.mark.parametrize("count", [0, 5, 25, 40, 300])
@pytest.mark.parametrize(
    ("room", "scale"), [(QRect(0, 0, 795, 594), 1.0), (QRect(0, 0, 1190, 940), 1.5)]
)
def test_many_injuries_are_cut_short_and_told_of(
    application: QApplication, room: QRect, scale: float, count: int
) -> None:
    score = Score(1.0, 2.0, 3.0, 0, {})
    end = Hurt("The flight is over", score, count=count)
    card = ResultCard.fitting(room, end, scale)
    assert QRectF(room).contains(card.box)
    assert SMALLEST * scale <= card.scale <= scale
    if card.rows == end.rows():
        return
    # it is full, and says how much is missing
    assert card.scale == SMALLEST * scale
    assert count > 5
    *kept, (_, said) = card.rows
    assert kept == end.rows()[: len(kept)]
    assert said.startswith(f"{count - len(kept)} more rows")
    assert room.height() - card.box.height() < 60 * scale
