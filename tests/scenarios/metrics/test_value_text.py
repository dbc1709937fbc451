"""One formatter for all values: no digit that means nothing, and no exponent."""

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.metrics.value_text import DIGITS, FINEST, value_text

ROOT = Path(__file__).parents[3]
FINITE = st.floats(-1e12, 1e12)
SIGMAS = st.none() | st.floats(0.0, 1e9)


def halves(text: str) -> tuple[str, str]:
    value, _, sigma = text.partition(" ± ")
    return value, sigma


@given(FINITE, SIGMAS)
def test_a_text_has_no_exponent_and_is_the_value_to_the_digits_shown(
    value: float, sigma: float | None
) -> None:
    told, about = halves(value_text(value, sigma))
    assert "e" not in told + about
    assert not told.startswith("-0") or float(told) != 0.0
    _, _, decimals = told.partition(".")
    step = 10.0 ** -len(decimals)
    if not about and sigma is None:
        # trailing zeros are left out
        step = min(step, max(10.0**-FINEST, abs(value) * 10.0 ** (1 - DIGITS)))
    assert abs(float(told) - value) <= 0.5001 * max(step, 10.0**-FINEST)


@given(FINITE, st.floats(0.0, 1e9))
def test_a_sigma_is_told_by_as_many_decimals_or_not_at_all(
    value: float, sigma: float
) -> None:
    told, about = halves(value_text(value, sigma))
    if about:
        assert float(about) > 0.0
        assert len(told.partition(".")[2]) == len(about.partition(".")[2])
        assert abs(float(about) - sigma) <= 0.06 * sigma or "." not in about
    else:
        assert sigma < max(abs(value) * 10.0 ** (1 - DIGITS), 10.0**-FINEST)


@pytest.mark.parametrize(
    ("value", "sigma", "unit", "text"),
    [
        (139.0, 2.9e-14, "s", "139 s"),
        (31.5, 0.25, "s", "31.50 ± 0.25 s"),
        (20.0, 0.5, "mm", "20.0 ± 0.5 mm"),
        (0.05, 12.0, "mm", "0 ± 12 mm"),
        (1234.56, None, "mm", "1235 mm"),
        (3.0, None, "count", "3"),
        (1e-17, 1e-18, "1", "0"),
        (-1e-17, None, "1", "0"),
        (0.2, None, "1", "0.2"),
    ],
)
def test_examples(value: float, sigma: float | None, unit: str, text: str) -> None:
    assert value_text(value, sigma, unit) == text


def test_nobody_else_writes_a_sigma() -> None:
    """Siblings had their own: ``139 ± 2.9e-14 s`` came of one of eight."""
    own = re.compile(r"\}\s+±|±\s+\{|%\s*±")
    wrong = [
        f"{path.relative_to(ROOT)}: {line.strip()}"
        for package in ("app", "paravol", "scenarios")
        for path in sorted((ROOT / package).rglob("*"))
        if path.suffix in (".py", ".html", ".js") and path.name != "value_text.py"
        for line in path.read_text("utf-8").splitlines()
        if own.search(line)
    ]
    assert not wrong
