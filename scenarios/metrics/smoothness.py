"""How smooth movements are: log dimensionless jerk in two forms, and SPARC.

S. Balasubramanian, A. Melendez-Calderon, A. Roby-Brami, E. Burdet: On the analysis of
movement smoothness, J. NeuroEng. Rehabil. 12:112, 2015. Both are defined for one
movement: a pause within what is scored counts as unsmooth. Tracks are therefore split
into movements, and the median over them is told.
"""

import math
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from scenarios.metrics.episodes import stretches
from scenarios.metrics.measured import Measured
from scenarios.metrics.metric import (
    SCOPE,
    TOOL,
    Definition,
    Found,
    Interval,
    too_little,
)
from scenarios.metrics.track import LEAST_SAMPLES, Piece

Doubles = NDArray[np.float64]

PAD_LEVEL = 4
HIGHEST_HZ = 10.0
LEAST_MAGNITUDE = 0.05
"""Of SPARC: zero padding, and where the spectrum is cut; the authors' figures."""

_ROUNDING = 1e-12
"""A jerk below this share of what the samples could have is rounding alone."""


def ldlj_of_speed(speed: Doubles, rate_hz: float) -> float | None:
    """Return the log dimensionless jerk of a speed profile ``(n,)``.

    -ln(T^3 / v_peak^2 * integral of (d2v/dt2)^2), T = n / rate. None where speed has no
    second derivative beyond rounding, as in uniform motion, or no peak.
    """
    if len(speed) < 3:
        return None
    second = np.diff(speed, 2) * rate_hz**2
    return _ldlj(second[:, None], np.abs(speed), len(speed), rate_hz)


def ldlj_of_position(tip_mm: Doubles, rate_hz: float) -> float | None:
    """Return the log dimensionless jerk of positions ``(n, 3)``.

    As `ldlj_of_speed` with the third derivative of the position vector. A turn of the
    direction at even speed counts here, and there not.
    """
    if len(tip_mm) < LEAST_SAMPLES:
        return None
    speed = np.linalg.norm(np.diff(tip_mm, axis=0), axis=1) * rate_hz
    third = np.diff(tip_mm, 3, axis=0) * rate_hz**3
    return _ldlj(third, speed, len(speed), rate_hz)


def sparc(speed: Doubles, rate_hz: float) -> float | None:
    """Return the spectral arc length of a speed profile ``(n,)``.

    Negative; nearer to zero is smoother. None for fewer than 3 samples or no speed.
    """
    if len(speed) < 3:
        return None
    size = 2 ** (math.ceil(math.log2(len(speed))) + PAD_LEVEL)
    magnitude = np.abs(np.fft.rfft(speed, size))
    if not magnitude.max() > 0.0:
        return None
    magnitude = magnitude / magnitude.max()
    frequency = np.arange(len(magnitude)) * (rate_hz / size)
    kept = frequency <= HIGHEST_HZ
    frequency, magnitude = frequency[kept], magnitude[kept]
    last = int(np.flatnonzero(magnitude >= LEAST_MAGNITUDE)[-1])
    if last == 0:
        return None
    across = np.diff(frequency[: last + 1]) / frequency[last]
    return -float(np.hypot(across, np.diff(magnitude[: last + 1])).sum())


def movements(measured: Measured, role: str) -> list[tuple[Piece, slice, Interval]]:
    """Split a tool's way into movements; each is a slice of a piece's speeds."""
    settings = measured.settings
    found = []
    for piece in measured.pieces(role):
        speed = piece.speed_mm_s
        # a movement begins where the speed last was below rest, not at the onset
        for begin, end in stretches(speed >= settings.rest_mm_s):
            if not (speed[begin:end] > settings.onset_mm_s).any():
                continue
            if end - begin >= settings.movement_s * piece.rate_hz:
                span = float(piece.time_s[begin]), float(piece.time_s[end])
                found.append((piece, slice(begin, end), span))
    return found


def movement_count(measured: Measured, role: str) -> Found:
    """Return how many movements there were."""
    if not measured.pieces(role):
        return too_little("four samples without a gap are needed")
    spans = tuple(span for _, _, span in movements(measured, role))
    return Found(float(len(spans)), spans)


def _speed_form(piece: Piece, part: slice) -> float | None:
    return ldlj_of_speed(piece.speed_mm_s[part], piece.rate_hz)


def _vector_form(piece: Piece, part: slice) -> float | None:
    # one sample more than there are speeds between
    return ldlj_of_position(piece.tip_mm[part.start : part.stop + 1], piece.rate_hz)


def _sparc(piece: Piece, part: slice) -> float | None:
    return sparc(piece.speed_mm_s[part], piece.rate_hz)


def median_over_movements(
    measured: Measured,
    role: str,
    score: Callable[[Piece, slice], float | None],
) -> Found:
    """Return the median of what movements score, and which ones have a score."""
    values: list[float] = []
    spans: list[Interval] = []
    for piece, part, span in movements(measured, role):
        value = score(piece, part)
        if value is not None:
            values.append(value)
            spans.append(span)
    if not values:
        return too_little("one movement is needed")
    return Found(float(np.median(values)), tuple(spans))


def root_squared_jerk(measured: Measured, role: str) -> Found:
    """Return sqrt(integral |jerk|^2 dt) of the low-passed path, mm s^-2.5.

    Not normalised for time or size: PerkTutor's "motion smoothness".
    """
    pieces = measured.pieces(role)
    if not pieces:
        return too_little("four samples without a gap are needed")
    total = 0.0
    for piece in pieces:
        jerk = np.diff(piece.tip_mm, 3, axis=0) * piece.rate_hz**3
        total += float((jerk**2).sum()) / piece.rate_hz
    spans = tuple((float(p.time_s[0]), float(p.time_s[-1])) for p in pieces)
    return Found(math.sqrt(total), spans)


def _ldlj(
    derivative: Doubles, speed: Doubles, count: int, rate_hz: float
) -> float | None:
    peak = float(speed.max())
    squared = float((derivative**2).sum()) / rate_hz
    duration_s = count / rate_hz
    # what second differences of the speed would come to if they were as large as it
    largest = (4.0 * peak * rate_hz**2) ** 2 * duration_s
    if not peak > 0.0 or squared <= (_ROUNDING**2) * largest:
        return None
    return -math.log(duration_s**3 / peak**2 * squared)


def _definitions() -> Iterator[Definition]:
    smooth = "low-passed"
    for role in (SCOPE, TOOL):
        yield Definition(
            "movements", role, "count", partial(movement_count, role=role), smooth
        )
        for name, score in (
            ("LDLJ, vector form", _vector_form),
            ("LDLJ, speed form", _speed_form),
            ("SPARC", _sparc),
        ):
            compute = partial(median_over_movements, role=role, score=score)
            yield Definition(name, role, "1", compute, smooth)
        compute = partial(root_squared_jerk, role=role)
        yield Definition(
            "motion smoothness", role, "mm s^-2.5", compute, smooth, moves=True
        )


SMOOTHNESS = tuple(_definitions())
