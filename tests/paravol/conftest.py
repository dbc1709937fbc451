"""Exercises, screens and processes for the tests of flights without a window."""

import pytest

from tests.flights import (
    coarse_scenario,
    family,
    screen,
    shifted_file,
    short_scenario,
    train,
)
from tests.recorded_flight import Recorded, shaved

__all__ = [
    "coarse_scenario",
    "family",
    "screen",
    "shifted_file",
    "short_scenario",
    "train",
]


@pytest.fixture(scope="session")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """A recorded operation in which somebody shaves before an orbit; see `shaved`."""
    return shaved(tmp_path_factory.mktemp("recorded") / "flight.paravol")
