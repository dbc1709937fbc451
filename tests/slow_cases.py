"""Cases of a law that `make test` leaves out, as another stands for them."""

from collections.abc import Iterable

import pytest


def slow(*cases: object) -> Iterable[object]:
    """Mark parameters, or tuples of them, as slow."""
    for case in cases:
        values = case if isinstance(case, tuple) else (case,)
        yield pytest.param(*values, marks=pytest.mark.slow)
