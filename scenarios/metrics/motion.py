"""Time, path and economy of a tool's tip."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from scenarios.metrics.episodes import held, intervals, stretches
from scenarios.metrics.measured import Measured
from scenarios.metrics.metric import (
    HANDS,
    SCOPE,
    TOOL,
    Answer,
    Definition,
    Found,
    Interval,
    too_little,
)
from scenarios.metrics.track import Piece, lengths, turns_deg

Doubles = NDArray[np.float64]

TWO = "two samples of one pose stream are needed"
FOUR = "four samples without a gap are needed"

_SINGULAR_MM = 1.0
"""A way that ends nearer than this to its beginning has no straight reference."""

_LEAST_CORRELATED = 3


def task_time_s(measured: Measured, role: str) -> Found:
    """Return the time in which the tool was measured."""
    spans = measured.spans(role)
    if not spans:
        return too_little(TWO)
    return Found(sum(end - begin for begin, end in spans), spans)


def raw_path_mm(measured: Measured, role: str) -> Found:
    """Return the summed distance from sample to sample."""
    track = measured.track(role)
    spans = measured.spans(role)
    if not spans:
        return too_little(TWO)
    total = sum(
        float(lengths(np.diff(track.tip_mm[places], axis=0)).sum())
        for places in track.spans(measured.settings.gap_s)
    )
    return Found(total, spans)


def path_mm(measured: Measured, role: str) -> Found:
    """Return the length of the low-passed path."""
    return _summed(measured, role, lambda piece: lengths(piece.steps_mm))


def depth_mm(measured: Measured, role: str) -> Found:
    """Return the way along the tool's own axis, to and fro."""
    return _summed(measured, role, lambda piece: np.abs(_advance(piece)))


def retracting_mm(measured: Measured, role: str) -> Found:
    """Return the length of the path on which the tool was drawn back."""
    return _summed(
        measured,
        role,
        lambda piece: np.where(_advance(piece) < 0.0, lengths(piece.steps_mm), 0.0),
    )


def rotation_deg(measured: Measured, role: str) -> Found:
    """Return the summed angle between successive orientations."""
    return _summed(measured, role, lambda piece: turns_deg(piece.quaternion))


def mean_speed_mm_s(measured: Measured, role: str) -> Found:
    """Return path by time; the mean of ratios is biased where stamps jitter."""
    pieces = measured.pieces(role)
    time_s = sum(piece.duration_s for piece in pieces)
    if not time_s > 0.0:
        return too_little(FOUR)
    path = path_mm(measured, role)
    assert path.value is not None
    return Found(path.value / time_s, path.intervals)


def idle_share(measured: Measured, role: str) -> Found:
    """Return the share of time in which the tool rested."""
    settings = measured.settings
    pieces = measured.pieces(role)
    time_s = sum(piece.duration_s for piece in pieces)
    if not time_s > 0.0:
        return too_little(FOUR)
    found: list[Interval] = []
    for piece in pieces:
        least = settings.idle_s * piece.rate_hz
        for begin, end in stretches(piece.speed_mm_s < settings.idle_mm_s):
            if end - begin >= least:
                found.append((float(piece.time_s[begin]), float(piece.time_s[end])))
    idle_s = sum(end - begin for begin, end in found)
    return Found(idle_s / time_s, tuple(found))


def economy(measured: Measured) -> Found:
    """Return the shortest way through the air by the way taken, at most 1."""
    reference = measured.reference
    if reference is None:
        return Found(None, (), "the shortest way through the air is not known")
    span = reference.begin_s, reference.end_s
    length_mm = sum(way_within_mm(piece, span) for piece in measured.scope_pieces)
    if not length_mm > 0.0:
        return too_little("a path is needed")
    return Found(min(reference.length_mm / length_mm, 1.0), (span,))


def way_within_mm(piece: Piece, span: Interval) -> float:
    """Return the length of a piece's path between two moments."""
    begin, end = np.interp(span, piece.time_s, piece.way_mm)
    return float(end - begin)


def path_inefficiency_percent(measured: Measured, role: str) -> Found:
    """Return by how much the path is longer than the straight line."""
    pieces = measured.pieces(role)
    if not pieces:
        return too_little(FOUR)
    path = path_mm(measured, role)
    assert path.value is not None
    straight = float(np.linalg.norm(pieces[-1].tip_mm[-1] - pieces[0].tip_mm[0]))
    if straight < _SINGULAR_MM:
        return Found(
            None,
            path.intervals,
            f"the way ends within {_SINGULAR_MM:g} mm of its beginning",
        )
    return Found(100.0 * (path.value / straight - 1.0), path.intervals)


def actions(measured: Measured, role: str) -> Found:
    """Return how often the tip was faster than the threshold."""
    settings = measured.settings
    return _actions(measured, role, settings.action_mm_s, is_turn=False)


def turn_actions(measured: Measured, role: str) -> Found:
    """Return how often the tool turned faster than the threshold."""
    settings = measured.settings
    return _actions(measured, role, settings.action_deg_s, is_turn=True)


def speed_peaks_per_min(measured: Measured, role: str) -> Answer:
    """Return the peaks of speed above each threshold, a minute."""
    # loaded where it is needed: it takes a second, and no flight waits for it
    from scipy.signal import find_peaks

    pieces = measured.pieces(role)
    time_s = sum(piece.duration_s for piece in pieces)
    found = {}
    for threshold in measured.settings.peak_mm_s:
        name = f"above {threshold:g} mm/s"
        if not time_s > 0.0:
            found[name] = too_little(FOUR)
            continue
        moments: list[Interval] = []
        for piece in pieces:
            peaks, _ = find_peaks(piece.speed_mm_s, height=threshold)
            moments += [(t, t) for t in piece.time_s[peaks].tolist()]
        found[name] = Found(60.0 * len(moments) / time_s, tuple(moments))
    return found


def tip_bimanual(measured: Measured) -> Found:
    """Return how the speeds of both tips go together."""
    return _correlated(measured, is_turn=False)


def turn_bimanual(measured: Measured) -> Found:
    """Return how the angular speeds of both hands go together."""
    return _correlated(measured, is_turn=True)


def nearest_to_targets_mm(measured: Measured, role: str) -> Answer:
    """Return the nearest approach of the tip to each target."""
    track = measured.track(role)
    places = track.valid
    found = {}
    for name, at in measured.targets.items():
        if len(places) == 0:
            found[name] = too_little("a sample is needed")
            continue
        away = lengths(track.tip_mm[places] - at)
        nearest = int(np.argmin(away))
        time_s = float(track.time_s[places[nearest]])
        found[name] = Found(float(away[nearest]), ((time_s, time_s),))
    return found


def _advance(piece: Piece) -> Doubles:
    """Return the steps' parts along where the tool points, ``(n - 1,)``."""
    middle = piece.back[:-1] + piece.back[1:]
    middle = middle / np.linalg.norm(middle, axis=1, keepdims=True)
    advance: Doubles = -np.einsum("ij,ij->i", piece.steps_mm, middle)
    return advance


def _summed(measured: Measured, role: str, steps: Callable[[Piece], Doubles]) -> Found:
    pieces = measured.pieces(role)
    if not pieces:
        return too_little(FOUR)
    spans = tuple((float(p.time_s[0]), float(p.time_s[-1])) for p in pieces)
    return Found(float(sum(float(steps(piece).sum()) for piece in pieces)), spans)


def _actions(
    measured: Measured, role: str, threshold: float, *, is_turn: bool
) -> Found:
    """Count episodes above a threshold that last longer than the hysteresis."""
    pieces = measured.pieces(role)
    if not pieces:
        return too_little(FOUR)
    found: list[Interval] = []
    for piece in pieces:
        speed = piece.turn_deg_s if is_turn else piece.speed_mm_s
        fast = speed > threshold
        least = measured.settings.action_s * piece.rate_hz
        opens, closes = np.zeros_like(fast), np.zeros_like(fast)
        for begin, end in stretches(fast):
            if end - begin > least:
                opens[begin:end] = True
        for begin, end in stretches(~fast):
            if end - begin > least:
                closes[begin:end] = True
        state = held(opens, closes)
        found += intervals(piece.time_s[:-1], state, measured.settings.gap_s)
    return Found(float(len(found)), tuple(found))


def _correlated(measured: Measured, *, is_turn: bool) -> Found:
    """Return Pearson's correlation of both tools' speeds while both are measured."""
    left: list[Doubles] = []
    right: list[Doubles] = []
    spans: list[Interval] = []
    for first, second, span in _together(measured):
        left.append(_speeds(first, span, is_turn=is_turn))
        right.append(_speeds(second, span, is_turn=is_turn))
        spans.append(span)
    if not left:
        return too_little("both tools must be measured at the same time")
    a, b = np.concatenate(left), np.concatenate(right)
    if len(a) < _LEAST_CORRELATED:
        return too_little(f"{_LEAST_CORRELATED} samples of both tools are needed")
    a, b = a - a.mean(), b - b.mean()
    product = float(np.sqrt((a @ a) * (b @ b)))
    if product <= 1e-9:
        return Found(None, tuple(spans), "one hand was still: no correlation")
    return Found(float(a @ b) / product, tuple(spans))


def _together(measured: Measured) -> Iterator[tuple[Piece, Piece, Interval]]:
    for first in measured.scope_pieces:
        for second in measured.tool_pieces:
            begin = max(first.time_s[0], second.time_s[0])
            end = min(first.time_s[-2], second.time_s[-2])
            if end > begin:
                yield first, second, (float(begin), float(end))


def _speeds(piece: Piece, span: Interval, *, is_turn: bool) -> Doubles:
    count = int((span[1] - span[0]) * piece.rate_hz + 1e-6) + 1
    times = span[0] + np.arange(count) / piece.rate_hz
    speed = piece.turn_deg_s if is_turn else piece.speed_mm_s
    read: Doubles = np.interp(times, piece.time_s[:-1], speed)
    return read


def _definitions() -> Iterator[Definition]:
    smooth = "low-passed"
    for role in (SCOPE, TOOL):
        for name, unit, compute, how, moves in (
            ("task time", "s", task_time_s, "raw", False),
            ("path length, raw", "mm", raw_path_mm, "raw", True),
            ("path length", "mm", path_mm, smooth, True),
            ("depth", "mm", depth_mm, smooth, True),
            ("path drawn back", "mm", retracting_mm, smooth, True),
            ("rotation", "deg", rotation_deg, smooth, True),
            ("mean speed", "mm/s", mean_speed_mm_s, smooth, True),
            ("idle share", "1", idle_share, smooth, False),
            ("path inefficiency", "%", path_inefficiency_percent, smooth, False),
            ("translational actions", "count", actions, smooth, False),
            ("rotational actions", "count", turn_actions, smooth, False),
            ("speed peaks", "1/min", speed_peaks_per_min, smooth, False),
            ("nearest to", "mm", nearest_to_targets_mm, "raw", False),
        ):
            yield Definition(name, role, unit, partial(compute, role=role), how, moves)
    yield Definition("economy of motion", SCOPE, "1", economy, smooth)
    yield Definition("bimanual dexterity, tips", HANDS, "1", tip_bimanual, smooth)
    yield Definition("bimanual dexterity, turns", HANDS, "1", turn_bimanual, smooth)


MOTION = tuple(_definitions())
