from typing import Any

import pytest

from scenarios.metrics import Measured, Settings, Taken
from scenarios.metrics.removal import (
    fitting_share,
    protected_share,
    removed,
    taken_mm3,
    wanted_share,
)
from tests.scenarios.metrics.tracks import NO_TRACK, of_scope

EDITS = (
    Taken(1.0, "backbiter", {"uncinate": 30.0, "mucosa": 10.0}),
    Taken(2.0, "backbiter", {"uncinate": 50.0, "lamina papyracea": 2.0}),
)


def operated(edits: tuple[Taken, ...] | None = EDITS, **wants: Any) -> Measured:
    return of_scope(NO_TRACK, edits=edits, settings=Settings(**wants))


def test_the_sum_is_that_of_the_tissues() -> None:
    found = removed(operated())
    assert isinstance(found, dict)
    assert found["in all"].value == pytest.approx(92.0)
    assert found["in all"].intervals == ((1.0, 1.0), (2.0, 2.0))
    assert found["lamina papyracea"].intervals == ((2.0, 2.0),)
    assert sum(taken_mm3(operated()).values()) == pytest.approx(92.0)


def test_quality_is_against_what_the_task_wanted() -> None:
    measured = operated(
        wanted_mm3={"uncinate": 60.0, "bulla": 40.0},
        protected_mm3={"lamina papyracea": 100.0},
    )
    # 60 of 100: the uncinate's surplus does not replace the bulla
    assert wanted_share(measured).value == pytest.approx(0.6)
    assert fitting_share(measured).value == pytest.approx(60 / 92)
    assert protected_share(measured).value == pytest.approx(0.02)


@pytest.mark.parametrize("compute", [wanted_share, fitting_share, protected_share])
def test_without_a_task_or_an_operation_the_reason_is_told(compute: object) -> None:
    assert callable(compute)
    for measured in (operated(), operated(None)):
        found = compute(measured)
        assert found.value is None
        assert found.reason


def test_who_took_nothing_took_nothing_wrong() -> None:
    measured = operated((), wanted_mm3={"uncinate": 60.0})
    assert wanted_share(measured).value == 0.0
    assert fitting_share(measured).value is None
