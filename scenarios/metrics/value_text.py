"""A value in words, with its 1 sigma and its unit, to digits that mean something."""

import math

DIGITS = 4
"""Of a value, at most; whole numbers are told whole."""

FINEST = 4
"""Decimals, at most: smaller is rounding, or of no interest in mm, s, N or percent."""

_NO_UNIT = "", "1", "count"


def value_text(value: float, sigma: float | None = None, unit: str = "") -> str:
    """Return a value such as ``12.3 ± 0.4 mm``; it never has an exponent.

    sigma: told to two digits, the value to as many decimals; left out where it is
    unknown, or less than what is shown of the value.
    """
    told = _figures(value, sigma)
    return told if unit in _NO_UNIT else f"{told} {unit}"


def _figures(value: float, sigma: float | None) -> str:
    if not math.isfinite(value):
        return f"{value}"
    decimals = _decimals(value, DIGITS)
    if sigma is not None and math.isfinite(sigma):
        fewer = min(decimals, _decimals(sigma, 2))
        if round(sigma, fewer) > 0.0:
            one, other = _rounded(value, fewer), _rounded(sigma, fewer)
            while "." in one and one[-1] == other[-1] == "0":
                one, other = one[:-1], other[:-1]
            return f"{one.rstrip('.')} ± {other.rstrip('.')}"
    told = _rounded(value, decimals)
    return told.rstrip("0").rstrip(".") if "." in told else told


def _decimals(value: float, digits: int) -> int:
    """Return how many decimals show so many digits of a value."""
    if value == 0.0:
        return FINEST
    return min(max(digits - 1 - math.floor(math.log10(abs(value))), 0), FINEST)


def _rounded(value: float, decimals: int) -> str:
    # what rounds to nothing has no sign
    return f"{round(value, decimals) + 0.0:.{decimals}f}"
