"""How well the scope shows what matters: horizon, centring, steadiness, distance."""

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scenarios.endoscope import LEAST_GRAVITY, SUPERIOR, Endoscope
from scenarios.metrics.episodes import intervals, stretches
from scenarios.metrics.measured import Measured
from scenarios.metrics.metric import (
    SCOPE,
    Answer,
    Definition,
    Found,
    Interval,
    too_little,
)
from scenarios.metrics.recorded import upright
from scenarios.metrics.track import Piece, lengths, second_column

Doubles = NDArray[np.float64]

NEVER = "the target was never looked at"


class Views(NamedTuple):
    """The picture's unit axes over a piece, ``(n, 3)`` each."""

    forward: Doubles
    right: Doubles
    up: Doubles


def views_of(endoscope: Endoscope, piece: Piece) -> Views:
    """Return the views of a scope whose y axis is its light post.

    As `Endoscope.camera` has them.
    """
    tilt = math.radians(endoscope.angle_deg)
    forward = -math.cos(tilt) * piece.back + math.sin(tilt) * second_column(
        piece.quaternion
    )
    forward = forward / lengths(forward)[:, None]
    right, up = upright(forward)
    turn = np.radians(piece.camera_deg)[:, None]
    cosine, sine = np.cos(turn), np.sin(turn)
    return Views(forward, cosine * right - sine * up, cosine * up + sine * right)


def horizon_error_deg(views: Views) -> tuple[Doubles, Doubles]:
    """Return the picture's turn from upright, and how much of "up" lies in it.

    0 to 180 degrees and 0 to 1, ``(n,)`` each; the turn is NaN where it is undefined.
    """
    across, upwards = views.right @ SUPERIOR, views.up @ SUPERIOR
    share = np.hypot(across, upwards)
    turn = np.degrees(np.abs(np.arctan2(across, upwards)))
    return np.where(share < LEAST_GRAVITY, np.nan, turn), share


def horizon(measured: Measured) -> Found:
    """Return the mean horizon error, weighted by how well it is defined."""
    weighted = total = 0.0
    for piece in measured.scope_pieces:
        error, share = horizon_error_deg(views_of(measured.endoscope_of(piece), piece))
        known = np.isfinite(error)
        weighted += float((error[known] * share[known]).sum())
        total += float(share[known].sum())
    if not total > 0.0:
        return too_little("a view with a horizon is needed")
    return Found(weighted / total, measured.spans(SCOPE))


class _Held(NamedTuple):
    """A target seen over a piece: angle to the axis, distance, when attended."""

    piece: Piece
    views: Views
    angle_deg: Doubles
    away_mm: Doubles
    is_attended: NDArray[np.bool_]
    is_centred: NDArray[np.bool_]


def _targets(
    measured: Measured, score: Callable[[Measured, list[_Held], Doubles], Found]
) -> Answer:
    seen = [
        (piece, views_of(measured.endoscope_of(piece), piece))
        for piece in measured.scope_pieces
    ]
    settings = measured.settings
    half_deg = measured.endoscope.field_of_view_deg / 2
    found = {}
    for name, at in measured.targets.items():
        parts = []
        for piece, views in seen:
            towards = at - piece.tip_mm
            away = lengths(towards)
            along = np.einsum("ij,ij->i", towards, views.forward)
            beside = lengths(towards - along[:, None] * views.forward)
            angle = np.degrees(np.arctan2(beside, along))
            attended = (away <= settings.attended_mm) & (angle <= half_deg)
            centred = attended & (angle <= settings.centred_deg)
            parts.append(_Held(piece, views, angle, away, attended, centred))
        if not parts:
            found[name] = too_little("four samples without a gap are needed")
        elif not any(part.is_attended.any() for part in parts):
            found[name] = Found(None, (), NEVER)
        else:
            found[name] = score(measured, parts, at)
    return found


def _share(
    measured: Measured, parts: list[_Held], good: list[NDArray[np.bool_]]
) -> Found:
    gap_s = measured.settings.gap_s
    whole = sum(int(part.is_attended.sum()) for part in parts)
    spans = [
        span
        for part, state in zip(parts, good, strict=True)
        for span in intervals(part.piece.time_s, state, gap_s)
    ]
    return Found(sum(int(state.sum()) for state in good) / whole, tuple(spans))


def _centred(measured: Measured, parts: list[_Held], at: Doubles) -> Found:
    """Return the share of attended time with the target in the middle."""
    return _share(measured, parts, [part.is_centred for part in parts])


def _off_axis(measured: Measured, parts: list[_Held], at: Doubles) -> Found:
    """Return the mean angle between the view's axis and the target."""
    angles = np.concatenate([part.angle_deg[part.is_attended] for part in parts])
    attended = _share(measured, parts, [part.is_attended for part in parts])
    return Found(float(angles.mean()), attended.intervals)


def _in_band(measured: Measured, parts: list[_Held], at: Doubles) -> Found:
    """Return the share of attended time at the working distance."""
    near, far = measured.settings.near_mm, measured.settings.far_mm
    good = [
        part.is_attended & (part.away_mm >= near) & (part.away_mm <= far)
        for part in parts
    ]
    return _share(measured, parts, good)


def _steadiness(measured: Measured, parts: list[_Held], at: Doubles) -> Found:
    """Return the rms angular rate of the view's axis while the target is centred."""
    squares, count = 0.0, 0
    for part in parts:
        both = part.is_centred[:-1] & part.is_centred[1:]
        forward = part.views.forward
        chord = lengths(np.diff(forward, axis=0))
        rate = np.degrees(2.0 * np.arcsin(np.clip(chord / 2.0, 0.0, 1.0)))
        rate = rate * part.piece.rate_hz
        squares += float((rate[both] ** 2).sum())
        count += int(both.sum())
    if count == 0:
        return Found(None, (), "the target was never centred")
    spans = _share(measured, parts, [part.is_centred for part in parts]).intervals
    return Found(math.sqrt(squares / count), spans)


def _pixel_motion(measured: Measured, parts: list[_Held], at: Doubles) -> Found:
    """Return the rms distance of the target's pixel from its mean while centred."""
    scale = measured.picture_px / 2 / (measured.endoscope.field_of_view_deg / 2)
    squares, count = 0.0, 0
    for part in parts:
        towards = at - part.piece.tip_mm
        aside = np.einsum("ij,ij->i", towards, part.views.right)
        above = np.einsum("ij,ij->i", towards, part.views.up)
        around = np.maximum(np.hypot(aside, above), 1e-12)
        # the lens is equidistant: pixels from the middle are the angle
        pixels = (scale * part.angle_deg / around)[:, None] * np.stack(
            [aside, above], axis=1
        )
        for begin, end in stretches(part.is_centred):
            held = pixels[begin:end]
            squares += float(((held - held.mean(axis=0)) ** 2).sum())
            count += end - begin
    if count == 0:
        return Found(None, (), "the target was never centred")
    spans = _share(measured, parts, [part.is_centred for part in parts]).intervals
    return Found(math.sqrt(squares / count), spans)


def tool_in_view(measured: Measured) -> Found:
    """Return the share of time in which the held tool's tip lay in the field.

    Tissue before it is not looked at.
    """
    visible = total = 0
    spans: list[Interval] = []
    half_deg = measured.endoscope.field_of_view_deg / 2
    for scope in measured.scope_pieces:
        forward = views_of(measured.endoscope_of(scope), scope).forward
        for tool in measured.tool_pieces:
            both = (scope.time_s >= tool.time_s[0]) & (scope.time_s <= tool.time_s[-1])
            if not both.any():
                continue
            times = scope.time_s[both]
            tip = np.stack(
                [np.interp(times, tool.time_s, column) for column in tool.tip_mm.T],
                axis=1,
            )
            towards = tip - scope.tip_mm[both]
            along = np.einsum("ij,ij->i", towards, forward[both])
            beside = lengths(towards - along[:, None] * forward[both])
            inside = np.degrees(np.arctan2(beside, along)) <= half_deg
            visible += int(inside.sum())
            total += len(times)
            spans += intervals(times, inside, measured.settings.gap_s)
    if total == 0:
        return too_little("scope and tool must be measured at the same time")
    return Found(visible / total, tuple(spans))


_OF_TARGETS = (
    ("centred share", "1", _centred),
    ("angle off axis", "deg", _off_axis),
    ("working distance share", "1", _in_band),
    ("unsteadiness", "deg/s", _steadiness),
    ("pixel motion", "px", _pixel_motion),
)

OF_TARGETS = frozenset(name for name, _, _ in _OF_TARGETS)
"""Metrics that have a value for each target, and none without any."""

SCOPE_VIEW = (
    Definition("horizon error", SCOPE, "deg", horizon, "low-passed"),
    *(
        Definition(name, SCOPE, unit, partial(_targets, score=score), "low-passed")
        for name, unit, score in _OF_TARGETS
    ),
    Definition("tool in view", SCOPE, "1", tool_in_view, "low-passed", sees_tool=True),
)
