"""Compiled: strands over a shaded picture, with soft edges at any width.

Positions are millimetres from the eye along world axes.
"""

import math

import numpy as np
from numba import njit

from renderers.simd.arrays import Doubles, Floats, Longs, f32

PERSPECTIVE = 1
"""The value of `Projection`."""
SOFT_MM = f32(0.08)
"""A hair comes out of the skin over this depth: renderers know depth no better."""
NEAREST_MM = f32(0.3)
LEAST_LIT_MM = 4.0
"""A hair nearer to a fibre is lit as if it were here. The fibres then shine on its
flanks, and what it takes it sends past the lens; the model of Kajiya and Kay knows no
direction round the hair and would let it glow."""
PUPIL_MM = f32(0.09)
"""Radius of the lens's entrance pupil: how far the edge of a near hair is spread."""
SHARP_MM = f32(6.0)
"""From here on a hair is sharp; nearer ones are out of focus."""
ASIDE_MM = f32(1.0), f32(2.5)
"""The scope pushes hairs aside: none is seen nearer than the first, all beyond the
second."""


@njit(cache=True, nogil=True, error_model="numpy")
def light_strands(
    points: Doubles, sources: Floats, forward: Doubles, spread: float, each: float,
    albedo: Floats, gloss: float, placed: Floats, colour: Floats,
) -> None:  # fmt: skip
    """Find the radiance ``(n, p, 3)`` of the points in view (Kajiya, Kay, 1989).

    A thin cylinder sends back as much of the light as falls across it.
    """
    last = points.shape[1] - 1
    t = np.empty(3)
    for n in range(points.shape[0]):
        for p in range(points.shape[1]):
            if placed[n, p, 3] <= 0:
                continue
            a, b = max(p - 1, 0), min(p + 1, last)
            length = 0.0
            for k in range(3):
                t[k] = points[n, b, k] - points[n, a, k]
                length += t[k] * t[k]
            length = math.sqrt(max(length, 1e-20))
            x, y, z = points[n, p, 0], points[n, p, 1], points[n, p, 2]
            away = math.sqrt(max(x * x + y * y + z * z, 1e-12))
            matt = shine = 0.0
            for s in range(sources.shape[0]):
                lx, ly, lz = sources[s, 0] - x, sources[s, 1] - y, sources[s, 2] - z
                d2 = lx * lx + ly * ly + lz * lz + 1e-6
                d = math.sqrt(d2)
                out = 1 + (lx * forward[0] + ly * forward[1] + lz * forward[2]) / d
                power = (
                    each
                    * math.exp(-spread * max(out, 0.0))
                    / max(d2, LEAST_LIT_MM * LEAST_LIT_MM)
                )
                with_l = (t[0] * lx + t[1] * ly + t[2] * lz) / (length * d)
                with_v = -(t[0] * x + t[1] * y + t[2] * z) / (length * away)
                sine = math.sqrt(max(1 - with_l * with_l, 0.0))
                both = sine * math.sqrt(max(1 - with_v * with_v, 0.0))
                matt += power * sine
                # to the 40th: how keen a hair's gloss is across its direction
                near2 = max(both - with_l * with_v, 0.0) ** 2
                near8 = near2 * near2 * near2 * near2
                near32 = near8 * near8 * near8 * near8
                shine += power * near32 * near8
            for c in range(3):
                colour[n, p, c] = albedo[c] * matt / math.pi + gloss * shine


@njit(cache=True, nogil=True, error_model="numpy")
def project_strands(
    points: Doubles, radius: Doubles, axes: Doubles, projection: int, widest: float,
    per_unit: float, distortion: tuple[float, float], width: int, height: int,
    placed: Floats,
) -> int:  # fmt: skip
    """Find column, row, distance and half width in pixels of points ``(n, p, 4)``.

    per_unit: pixels per radian or tangent in the middle. distortion: k1, k2. Points
    beyond `widest` radians from the axis get no width. Returns how many strands are in
    view.
    """
    seen = 0
    for n in range(points.shape[0]):
        any_seen = False
        for p in range(points.shape[1]):
            x, y, z = points[n, p, 0], points[n, p, 1], points[n, p, 2]
            a = axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z
            b = axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z
            c = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
            rho = math.sqrt(a * a + b * b)
            away = math.sqrt(rho * rho + c * c)
            theta = math.atan2(rho, c)
            placed[n, p, 3] = 0
            if theta > widest or away < NEAREST_MM:
                continue
            any_seen = True
            if projection == PERSPECTIVE:
                scale = per_unit / c
                wide = per_unit / c
            else:
                scale = per_unit * (theta / rho if rho > 1e-9 else 1 / away)
                wide = per_unit / away
            square = theta * theta
            if projection == PERSPECTIVE:
                square = rho / c * (rho / c)
            scale *= 1 + square * (distortion[0] + square * distortion[1])
            placed[n, p, 0] = width / 2 - 0.5 + a * scale
            placed[n, p, 1] = height / 2 - 0.5 - b * scale
            placed[n, p, 2] = away
            placed[n, p, 3] = radius[n, p] * wide
        seen += any_seen
    return seen


@njit(cache=True, nogil=True, error_model="numpy")
def draw_strands(
    placed: Floats, colour: Floats, order: Longs, depth: Floats,
    lens: Floats, per_unit: float, radiance: Floats, first: int, last: int,
) -> None:  # fmt: skip
    """Draw strands in `order` over rows ``first..last`` of the picture.

    A pixel gets the share of its own width that the strand covers, so that a hair
    thinner than a pixel fades instead of flickering. Out of focus that width is the
    pupil's: the hair covers as much as before, but over a wider strip.
    per_unit: pixels per radian or tangent in the middle.
    """
    width = depth.shape[1]
    pupil = f32(per_unit) * PUPIL_MM
    gone, whole = ASIDE_MM
    last_piece = placed.shape[1] - 2
    for n in order:
        for p in range(placed.shape[1] - 1):
            w0, w1 = placed[n, p, 3], placed[n, p + 1, 3]
            if w0 <= 0 or w1 <= 0:
                continue
            x0, y0, t0 = placed[n, p, 0], placed[n, p, 1], placed[n, p, 2]
            x1, y1, t1 = placed[n, p + 1, 0], placed[n, p + 1, 1], placed[n, p + 1, 2]
            nearest = max(min(t0, t1), gone)
            if max(t0, t1) <= gone:
                continue
            widest = max(pupil * (f32(1) / nearest - f32(1) / SHARP_MM), f32(0.5))
            reach = max(w0, w1) + widest
            top = max(math.floor(min(y0, y1) - reach), first)
            bottom = min(math.ceil(max(y0, y1) + reach), last - 1)
            left = max(math.floor(min(x0, x1) - reach), 0)
            right = min(math.ceil(max(x0, x1) + reach), width - 1)
            dx, dy = x1 - x0, y1 - y0
            inverse = f32(1) / max(dx * dx + dy * dy, f32(1e-12))
            slant = f32(math.sqrt(dx * dx + dy * dy)) / max(abs(dy), f32(1e-6))
            for y in range(top, bottom + 1):
                # a row meets a slanted strip in a short run
                middle = x0 + (f32(y) - y0) * dx / (dy if dy != 0 else f32(1e-6))
                run = reach * slant
                begin, end = left, right
                if run < f32(width):
                    begin = max(begin, math.floor(middle - run))
                    end = min(end, math.ceil(middle + run))
                for x in range(begin, end + 1):
                    if lens[y, x, 2] == f32(0):
                        continue
                    px, py = f32(x) - x0, f32(y) - y0
                    s = (px * dx + py * dy) * inverse
                    # only ends are round: a soft joint drawn twice would show as a knot
                    if (s < f32(0) and p > 0) or (s >= f32(1) and p < last_piece):
                        continue
                    s = min(max(s, f32(0)), f32(1))
                    px -= s * dx
                    py -= s * dy
                    off = f32(math.sqrt(px * px + py * py))
                    half = w0 + s * (w1 - w0)
                    t = t0 + s * (t1 - t0)
                    if t <= gone:
                        continue
                    soft = max(pupil * (f32(1) / t - f32(1) / SHARP_MM), f32(0.5))
                    cover = min(off + soft, half) - max(off - soft, -half)
                    if cover <= f32(0):
                        continue
                    cover /= f32(2) * soft
                    cover *= min((t - gone) / (whole - gone), f32(1))
                    if not t < depth[y, x] + f32(0.5) * SOFT_MM:
                        continue
                    out = (depth[y, x] - t) / SOFT_MM + f32(0.5)
                    cover *= min(out, f32(1))
                    for c in range(3):
                        own = colour[n, p, c]
                        own += s * (colour[n, p + 1, c] - own)
                        under = radiance[y, x, c]
                        radiance[y, x, c] = under + cover * (own - under)
