"""Compiled evaluation of stack programs over bricks of a lattice or over points.

Every loop treats one point by itself, in float32, without reassociation: a point's
value has the same bits in any brick, on any thread, in any field of view. Lattice
coordinates are ``index * spacing`` with one global index for the same reason.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit

F0, F1, HALF = np.float32(0), np.float32(1), np.float32(0.5)
FAR = np.float32(99)

SOLID_ROWS, PHARYNX_ROW, OUTSIDE_ROW, SKIN_ROW = 5, 5, 6, 9
"""Rows of marks with a meaning here: the first five are solids inside the cavity, the
pharynx and the outside are air shared by both sides, skin is where the nose is dry."""


class Tables(NamedTuple):
    """Bundle the arrays that describe one head (`anatomy.model` fills them).

    code ``(n, 4)`` int32, constants ``(m,)``: the stack programs.
    parts ``(P, 4)`` int32: first instruction, end, side, cavity (0: never opposite).
    reach ``(P, 2)``: Lipschitz constant and noise bound of each part.
    common ``(2,)`` int32: span of the field that only leaves marks.
    septum ``(5,)``: deviation, centre y, 1 / extent y, centre z, 1 / extent z.
    octaves ``(k, 16)``, limits ``(2,)``, perm ``(256,)``, grad ``(256, 3)``: noise.
    tint ``(r, 4)``: mark row, centre mm, half width mm, blood fraction.
    solids ``(q, 5)``: mark row, half thickness mm (0: solid), HU, label, 1 / (blur mm).
    """

    code: Any
    constants: Any
    parts: Any
    reach: Any
    common: Any
    septum: Any
    octaves: Any
    limits: Any
    perm: Any
    grad: Any
    tint: Any
    solids: Any


class Grids(NamedTuple):
    """Bundle the output arrays, each ``(nz, ny, nx)``.

    air: least part value, clamped to the band, float32 mm; gap: least value of a part
    of another cavity, float32 mm; part: index of the least part, 255 where none is in
    the band; structure: row of the solid's mark at this place, 255 for none; blood:
    blood fraction, square root scale; skin: skin weight; ground_hu int16 and ground:
    HU and label of what lies behind mucosa and bone shell.
    """

    air: Any
    gap: Any
    part: Any
    structure: Any
    blood: Any
    skin: Any
    ground_hu: Any
    ground: Any


@njit(cache=True, nogil=True, error_model="numpy")
def _smooth_min(a: Any, b: Any, k: Any, share: Any) -> Any:
    e = max(k - abs(a - b), F0)
    return min(a, b) - e * e * share


@njit(cache=True, nogil=True, error_model="numpy")
def _chain(c: Any, o: int, count: int, p: Any, n: int, out: Any) -> None:
    out[:n] = np.float32(1e9)
    for k in range(count):
        b = o + 9 * k
        ax, ay, az, dx, dy, dz = c[b], c[b + 1], c[b + 2], c[b + 3], c[b + 4], c[b + 5]
        inverse, r, dr = c[b + 6], c[b + 7], c[b + 8]
        for i in range(n):
            x, y, z = p[0, i] - ax, p[1, i] - ay, p[2, i] - az
            t = min(max((x * dx + y * dy + z * dz) * inverse, F0), F1)
            x, y, z = x - t * dx, y - t * dy, z - t * dz
            out[i] = min(out[i], np.sqrt(x * x + y * y + z * z) - (r + dr * t))


@njit(cache=True, nogil=True, error_model="numpy")
def _cells(c: Any, o: int, count: int, p: Any, n: int, out: Any) -> None:
    half, k, share = c[o], c[o + 1], c[o + 2]
    s = o + 3
    for i in range(n):
        x, y, z = p[0, i], p[1, i], p[2, i]
        owner, least = 0, np.float32(1e9)
        for j in range(count):
            a, b, d = x - c[s + 3 * j], y - c[s + 3 * j + 1], z - c[s + 3 * j + 2]
            q = a * a + b * b + d * d
            if q < least:
                owner, least = j, q
        ox, oy, oz = c[s + 3 * owner], c[s + 3 * owner + 1], c[s + 3 * owner + 2]
        wall = np.float32(1e3)
        for j in range(count):
            if j != owner:
                jx, jy, jz = c[s + 3 * j], c[s + 3 * j + 1], c[s + 3 * j + 2]
                a, b, d = x - jx, y - jy, z - jz
                q = a * a + b * b + d * d
                a, b, d = jx - ox, jy - oy, jz - oz
                gap = np.sqrt(a * a + b * b + d * d)
                wall = _smooth_min(wall, HALF * (q - least) / gap, k, share)
        out[i] = -_smooth_min(-out[i], wall - half, k, share)


@njit(cache=True, nogil=True, error_model="numpy")
def _run(
    code: Any, c: Any, start: int, stop: int, p: Any, noise: Any, n: int, s: Any, m: Any
) -> None:
    """Run rows `start` to `stop` for `n` points ``p[:, :n]``; leave s[0], marks m."""
    top = -1
    for row in range(start, stop):
        op, o, count, selector = code[row, 0], code[row, 1], code[row, 2], code[row, 3]
        if op == 0:  # affine
            top += 1
            c0, cu, cy, cz = c[o], c[o + 1], c[o + 2], c[o + 3]
            for i in range(n):
                s[top, i] = c0 + cu * p[0, i] + cy * p[1, i] + cz * p[2, i]
        elif op == 1:  # table
            top += 1
            s[top, :n] = c[o]
            w2 = c[o + 1]
            for k in range(count):
                knot, change = c[o + 2 + 2 * k], c[o + 3 + 2 * k]
                for i in range(n):
                    t = p[selector, i] - knot
                    s[top, i] += change * (t + np.sqrt(t * t + w2))
        elif op == 2:  # chain
            top += 1
            _chain(c, o, count, p, n, s[top])
        elif op == 3:  # ellipsoid
            top += 1
            eu, ey, ez = c[o], c[o + 1], c[o + 2]
            iu, iy, iz = c[o + 3], c[o + 4], c[o + 5]
            for i in range(n):
                a, b, d = (p[0, i] - eu) * iu, (p[1, i] - ey) * iy, (p[2, i] - ez) * iz
                k0 = np.sqrt(a * a + b * b + d * d)
                a, b, d = a * iu, b * iy, d * iz
                k1 = np.sqrt(a * a + b * b + d * d) + np.float32(1e-6)
                s[top, i] = k0 * (k0 - F1) / k1
        elif op == 4:  # flat tube from centre u, centre z, half u, half z
            top -= 3
            for i in range(n):
                a = max(s[top + 2, i], np.float32(0.05))
                b = max(s[top + 3, i], np.float32(0.05))
                du = (p[0, i] - s[top, i]) / a
                dz = (p[2, i] - s[top + 1, i]) / b
                s[top, i] = (np.sqrt(du * du + dz * dz) - F1) * min(a, b)
        elif op == 5:  # smooth minimum
            top -= 1
            k, share = c[o], c[o + 1]
            for i in range(n):
                s[top, i] = _smooth_min(s[top, i], s[top + 1, i], k, share)
        elif op == 6:  # smooth maximum
            top -= 1
            k, share = c[o], c[o + 1]
            for i in range(n):
                s[top, i] = -_smooth_min(-s[top, i], -s[top + 1, i], k, share)
        elif op == 7:
            top -= 1
            for i in range(n):
                s[top, i] += s[top + 1, i]
        elif op == 8:
            top -= 1
            for i in range(n):
                s[top, i] -= s[top + 1, i]
        elif op == 9:
            top -= 1
            for i in range(n):
                s[top, i] *= s[top + 1, i]
        elif op == 10:
            for i in range(n):
                s[top, i] = abs(s[top, i])
        elif op == 11:
            for i in range(n):
                s[top, i] = -s[top, i]
        elif op == 12:  # noise
            top += 1
            for i in range(n):
                s[top, i] = c[o] * noise[selector, i]
        elif op == 13:  # cells inside the region on the stack
            _cells(c, o, count, p, n, s[top])
        elif op == 14:  # mark
            for i in range(n):
                m[selector, i] = min(m[selector, i], s[top, i])


@njit(cache=True, nogil=True, error_model="numpy")
def _gradient_noise(x: Any, y: Any, z: Any, perm: Any, grad: Any) -> Any:
    """Give Perlin's gradient noise with the quintic fade, period 256 cells."""
    fx, fy, fz = np.floor(x), np.floor(y), np.floor(z)
    ix, iy, iz = int(fx), int(fy), int(fz)
    x, y, z = x - fx, y - fy, z - fz
    six, ten, fif = np.float32(6), np.float32(10), np.float32(15)
    u = x * x * x * (x * (x * six - fif) + ten)
    v = y * y * y * (y * (y * six - fif) + ten)
    w = z * z * z * (z * (z * six - fif) + ten)
    total = F0
    for corner in range(8):
        a, b, d = corner & 1, corner >> 1 & 1, corner >> 2
        h = perm[(perm[(perm[(ix + a) & 255] + iy + b) & 255] + iz + d) & 255]
        dot = (
            grad[h, 0] * (x - np.float32(a))
            + grad[h, 1] * (y - np.float32(b))
            + grad[h, 2] * (z - np.float32(d))
        )
        total += (
            dot * (u if a else F1 - u) * (v if b else F1 - v) * (w if d else F1 - w)
        )
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def _noise_rows(
    p: Any, n: int, octaves: Any, limits: Any, perm: Any, grad: Any, out: Any
) -> None:
    """Sum octaves into their rows; each row is bounded softly by its limit.

    octaves: rows of (row, amplitude, matrix 9, offset 3, fade from y, fade over mm).
    """
    out[:, :n] = F0
    for k in range(octaves.shape[0]):
        o = octaves[k]
        row = int(o[0])
        for i in range(n):
            x, y, z = p[0, i], p[1, i], p[2, i]
            fade = min(max((o[14] - y) / o[15], F0), F1)
            if fade > F0:
                out[row, i] += (
                    o[1]
                    * fade
                    * _gradient_noise(
                        o[2] * x + o[3] * y + o[4] * z + o[11],
                        o[5] * x + o[6] * y + o[7] * z + o[12],
                        o[8] * x + o[9] * y + o[10] * z + o[13],
                        perm,
                        grad,
                    )
                )
    for row in range(out.shape[0]):
        for i in range(n):
            a = out[row, i] * limits[row]
            out[row, i] /= np.sqrt(F1 + a * a)


@njit(cache=True, nogil=True, error_model="numpy")
def _side_points(p: Any, n: int, side: Any, septum: Any, out: Any) -> None:
    """Turn RAS points into (u, y, z); side 0 gives the distance to the midline."""
    amplitude, y0, iy, z0, iz = septum[0], septum[1], septum[2], septum[3], septum[4]
    for i in range(n):
        a, b = (p[1, i] - y0) * iy, (p[2, i] - z0) * iz
        x = p[0, i] - amplitude * np.float32(math.exp(-(a * a + b * b)))
        out[0, i] = abs(x) if side == F0 else side * x
        out[1, i] = p[1, i]
        out[2, i] = p[2, i]


@njit(cache=True, nogil=True, error_model="numpy")
def evaluate_points(points: Any, t: Tables, work: Any, marks: Any, value: Any) -> None:
    """Give the least part value at ``(3, n)`` RAS points, unclamped.

    work: ``(8 + depth, n)`` scratch; marks: ``(rows, n)`` scratch.
    """
    n = points.shape[1]
    side_p, noise, stack = work[0:3], work[3:5], work[8:]
    _noise_rows(points, n, t.octaves, t.limits, t.perm, t.grad, noise)
    value[:n] = np.float32(1e9)
    for k in range(t.parts.shape[0]):
        _side_points(points, n, np.float32(t.parts[k, 2]), t.septum, side_p)
        begin, end = t.parts[k, 0], t.parts[k, 1]
        _run(t.code, t.constants, begin, end, side_p, noise, n, stack, marks)
        for i in range(n):
            value[i] = min(value[i], stack[0, i])


@njit(cache=True, nogil=True, error_model="numpy")
def _smoothstep(x: Any) -> Any:
    x = min(max(x, F0), F1)
    return x * x * (np.float32(3) - np.float32(2) * x)


@njit(cache=True, nogil=True, error_model="numpy")
def _normal_cdf(x: Any) -> Any:
    return np.float32(0.5 * math.erfc(-x * 0.7071067811865476))


@njit(cache=True, nogil=True, error_model="numpy")
def _describe(t: Tables, m: Any, i: int, inside: bool) -> Any:
    """Turn the marks of point `i` into blood, skin, ground HU and ground label."""
    blood = np.float32(0.11)
    if inside:
        for r in range(t.tint.shape[0]):
            d = (m[int(t.tint[r, 0]), i] - t.tint[r, 1]) / t.tint[r, 2]
            blood += (F1 - _smoothstep(HALF + HALF * d)) * (t.tint[r, 3] - blood)
    hu, label, best = np.float32(0), 0, F0
    for q in range(t.solids.shape[0]):
        d, half = m[int(t.solids[q, 0]), i] * t.solids[q, 4], t.solids[q, 1]
        if d > np.float32(4) + half * t.solids[q, 4]:
            continue
        if half > F0:
            half *= t.solids[q, 4]
            w = _normal_cdf(half - d) - _normal_cdf(-half - d)
        else:
            w = _normal_cdf(-d)
        hu += w * (t.solids[q, 2] - hu)
        best *= F1 - w
        if w >= best:
            best, label = w, int(t.solids[q, 3])
    return blood, hu, label


@njit(cache=True, nogil=True, error_model="numpy")
def fill_bricks(
    first: int,
    last: int,
    edge: int,
    skipping: bool,
    origin: Any,
    spacing: float,
    band: Any,
    t: Tables,
    work: Any,
    fresh: Any,
    kept: Any,
    flags: Any,
    g: Grids,
    counters: Any,
) -> None:
    """Evaluate bricks `first` to `last` of the lattice into the grids.

    A part whose value at the brick's centre, less what it can change on the way to a
    corner, exceeds `band` is left out: its values would all be clamped.

    origin: ``(3,)`` int64 global lattice index of voxel 0, RAS order x, y, z; the
    arrays run along -x and -y (their world is LPS). work, fresh, kept, flags: scratch.
    counters: bricks seen, bricks with a part in reach, part evaluations, parts seen.
    """
    nz, ny, nx = g.air.shape
    by, bx = (ny + edge - 1) // edge, (nx + edge - 1) // edge
    side_p, noise, p, stack = work[0:3], work[3:5], work[5:8], work[8:]
    rows, count = fresh.shape[0], t.parts.shape[0]
    for brick in range(first, last):
        z0, y0, x0 = brick // (by * bx), brick // bx % by, brick % bx
        z0, y0, x0 = z0 * edge, y0 * edge, x0 * edge
        z1, y1, x1 = min(z0 + edge, nz), min(y0 + edge, ny), min(x0 + edge, nx)
        dx, dy, dz = x1 - x0 - 1, y1 - y0 - 1, z1 - z0 - 1
        radius = 0.5 * spacing * math.sqrt(dx * dx + dy * dy + dz * dz)
        p[0, 0] = (origin[0] - 0.5 * (x0 + x1 - 1)) * spacing
        p[1, 0] = (origin[1] - 0.5 * (y0 + y1 - 1)) * spacing
        p[2, 0] = (origin[2] + 0.5 * (z0 + z1 - 1)) * spacing
        noise[:, 0] = F0
        active = 0
        for k in range(count):
            flags[k] = True
            if skipping:
                _side_points(p, 1, np.float32(t.parts[k, 2]), t.septum, side_p)
                begin, end = t.parts[k, 0], t.parts[k, 1]
                _run(t.code, t.constants, begin, end, side_p, noise, 1, stack, fresh)
                least = stack[0, 0] - t.reach[k, 0] * radius - t.reach[k, 1]
                flags[k] = least <= band
            active += flags[k]
        counters[0] += 1
        counters[1] += active > 0
        counters[2] += active
        counters[3] += count
        n = 0
        for z in range(z0, z1):
            for y in range(y0, y1):
                for x in range(x0, x1):
                    p[0, n] = (origin[0] - x) * spacing
                    p[1, n] = (origin[1] - y) * spacing
                    p[2, n] = (origin[2] + z) * spacing
                    g.air[z, y, x], g.gap[z, y, x], g.part[z, y, x] = band, band, 255
                    n += 1
        if active:
            _noise_rows(p, n, t.octaves, t.limits, t.perm, t.grad, noise)
        kept[:, :n] = FAR
        for k in range(count):
            if not flags[k]:
                continue
            _side_points(p, n, np.float32(t.parts[k, 2]), t.septum, side_p)
            fresh[:, :n] = FAR
            begin, end = t.parts[k, 0], t.parts[k, 1]
            _run(t.code, t.constants, begin, end, side_p, noise, n, stack, fresh)
            for r in range(rows):
                for i in range(n):
                    # Marks count only where their part does, so that leaving the
                    # part out elsewhere changes nothing.
                    if stack[0, i] < band:
                        kept[r, i] = min(kept[r, i], fresh[r, i])
            i = 0
            for z in range(z0, z1):
                for y in range(y0, y1):
                    for x in range(x0, x1):
                        v = stack[0, i]
                        i += 1
                        old = g.part[z, y, x]
                        cavity = t.parts[k, 3]
                        other = old != 255 and t.parts[old, 3] != cavity
                        if v < g.air[z, y, x]:
                            if cavity == 0:
                                g.gap[z, y, x] = band
                            elif other:
                                g.gap[z, y, x] = g.air[z, y, x]
                            g.air[z, y, x], g.part[z, y, x] = v, k
                        elif v < g.gap[z, y, x] and cavity != 0 and other:
                            g.gap[z, y, x] = v
        _side_points(p, n, F0, t.septum, side_p)
        _run(
            t.code, t.constants, t.common[0], t.common[1], side_p, noise, n, stack, kept
        )
        i = 0
        for z in range(z0, z1):
            for y in range(y0, y1):
                for x in range(x0, x1):
                    a = g.air[z, y, x]
                    inside = a < band
                    shared = min(kept[PHARYNX_ROW, i], kept[OUTSIDE_ROW, i])
                    if shared < a + band:
                        g.gap[z, y, x] = band
                    blood, hu, label = _describe(t, kept, i, inside)
                    structure, least = 255, np.float32(0.4)
                    for r in range(SOLID_ROWS):
                        if kept[r, i] < least:
                            structure, least = r, kept[r, i]
                    if structure == 255 and shared <= a + HALF and inside:
                        pharynx = kept[PHARYNX_ROW, i] <= shared
                        structure = PHARYNX_ROW if pharynx else OUTSIDE_ROW
                    g.structure[z, y, x] = structure
                    g.blood[z, y, x] = np.uint8(np.float32(255) * np.sqrt(blood) + HALF)
                    skin = F1 - _smoothstep(HALF + HALF * kept[SKIN_ROW, i])
                    g.skin[z, y, x] = np.uint8(np.float32(255) * skin + HALF)
                    g.ground_hu[z, y, x] = np.int16(round(hu))
                    g.ground[z, y, x] = label
                    i += 1
