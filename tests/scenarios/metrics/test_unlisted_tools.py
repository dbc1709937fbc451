"""Seconds with a tool that an exercise does not allow."""

import numpy as np
import pytest

from scenarios.metrics.measured import Measured, ToolUse
from scenarios.metrics.unlisted_tools import UNLISTED, unlisted_s
from tests.scenarios.metrics.tracks import NO_TRACK, of_scope

TIMES = np.arange(0.0, 10.0, 0.1)
USED = (TIMES > 1.95) & (TIMES < 4.95)


def measured(*allowed: str) -> Measured:
    use = ToolUse(TIMES, {"curette": USED, "suction tube": TIMES < 0.05})
    return of_scope(NO_TRACK, tool_use=use, allowed_tools=allowed)


def test_its_time_is_what_it_was_used_for() -> None:
    found = unlisted_s(measured("suction tube"))
    assert found.value == pytest.approx(3.0)
    assert np.array(found.intervals) == pytest.approx(np.array([[2.0, 5.0]]))
    assert found.reason == "curette"


def test_allowed_tools_do_not_count_and_an_empty_list_allows_all() -> None:
    assert unlisted_s(measured("curette", "suction tube")).value == 0.0
    assert unlisted_s(measured()).value == 0.0


def test_a_use_at_the_very_end_counts() -> None:
    """The last sample's state does not last: it must not be nothing for that."""
    use = ToolUse(TIMES, {"curette": TIMES[-1] == TIMES})
    found = unlisted_s(of_scope(NO_TRACK, tool_use=use, allowed_tools=("drill",)))
    assert found.value is not None
    assert found.value > 0.0


def test_nothing_is_said_of_what_nobody_recorded() -> None:
    assert UNLISTED == "unlisted tool in use"
    assert unlisted_s(of_scope(NO_TRACK, allowed_tools=("curette",))).value is None
