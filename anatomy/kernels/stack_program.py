"""Stack programs and solid noise over blocks of points.

Every loop treats one point by itself, in float32, without reassociation: a point's
value has the same bits in any block, whatever vector code its loop became.
"""

import math

import numpy as np
from numba import njit

from anatomy.kernels.tables import Floats, Ints

F0, F1, HALF = np.float32(0), np.float32(1), np.float32(0.5)


@njit(cache=True, nogil=True, error_model="numpy")
def _smooth_min(
    a: np.float32, b: np.float32, k: np.float32, share: np.float32
) -> np.float32:
    e = max(k - abs(a - b), F0)
    return min(a, b) - e * e * share


@njit(cache=True, nogil=True, error_model="numpy")
def _table(c: Floats, o: int, count: int, q: Floats, n: int, r: Floats) -> None:
    r[:n] = c[o]
    w2 = c[o + 1]
    for k in range(count):
        knot, change = c[o + 2 + 2 * k], c[o + 3 + 2 * k]
        for i in range(n):
            t = q[i] - knot
            r[i] += change * (t + np.sqrt(t * t + w2))


@njit(cache=True, nogil=True, error_model="numpy")
def _layered_table(
    c: Floats, o: int, count: int, axis: int, p: Floats, n: int, layer: int, r: Floats
) -> None:
    """Tabulate over y or z where layers of points share their z and their row of y."""
    q = p[axis]
    if axis == 1:
        _table(c, o, count, q, layer, r)
        for i in range(layer, n, layer):
            for j in range(layer):
                r[i + j] = r[j]
    else:
        for i in range(0, n, layer):
            _table(c, o, count, q[i:], 1, r[i:])
            value = r[i]
            for j in range(1, layer):
                r[i + j] = value


@njit(cache=True, nogil=True, error_model="numpy")
def _chain(c: Floats, o: int, count: int, p: Floats, n: int, out: Floats) -> None:
    out[:n] = np.float32(1e9)
    pu, py, pz = p[0], p[1], p[2]
    for k in range(count):
        b = o + 9 * k
        ax, ay, az, dx, dy, dz = c[b], c[b + 1], c[b + 2], c[b + 3], c[b + 4], c[b + 5]
        inverse, r, dr = c[b + 6], c[b + 7], c[b + 8]
        for i in range(n):
            x, y, z = pu[i] - ax, py[i] - ay, pz[i] - az
            t = min(max((x * dx + y * dy + z * dz) * inverse, F0), F1)
            x, y, z = x - t * dx, y - t * dy, z - t * dz
            out[i] = min(out[i], np.sqrt(x * x + y * y + z * z) - (r + dr * t))


@njit(cache=True, nogil=True, error_model="numpy")
def _cells(c: Floats, o: int, count: int, p: Floats, n: int, out: Floats) -> None:
    half, k, share = c[o], c[o + 1], c[o + 2]
    s = o + 3
    tiny, blunt = np.float32(1e-6), np.float32(0.25)
    for i in range(n):
        x, y, z = p[0, i], p[1, i], p[2, i]
        owner, least = 0, np.float32(1e9)
        for j in range(count):
            b = s + 4 * j
            dx, dy, dz = x - c[b], y - c[b + 1], z - c[b + 2]
            f = np.sqrt(dx * dx + dy * dy + dz * dz) - c[b + 3]
            if f < least:
                owner, least = j, f
        b = s + 4 * owner
        ox, oy, oz = x - c[b], y - c[b + 1], z - c[b + 2]
        away = F1 / max(least + c[b + 3], tiny)
        wall = np.float32(1e3)
        for j in range(count):
            if j != owner:
                b = s + 4 * j
                dx, dy, dz = x - c[b], y - c[b + 1], z - c[b + 2]
                far = np.sqrt(dx * dx + dy * dy + dz * dz)
                along = (dx * ox + dy * oy + dz * oz) * away / max(far, tiny)
                chord = np.sqrt(max(F1 + F1 - along - along, blunt))
                wall = _smooth_min(wall, (far - c[b + 3] - least) / chord, k, share)
        out[i] = half - wall


@njit(cache=True, nogil=True, error_model="numpy")
def run_program(
    code: Ints,
    c: Floats,
    start: int,
    stop: int,
    p: Floats,
    noise: Floats,
    n: int,
    layer: int,
    s: Floats,
    m: Floats,
) -> None:
    """Run rows `start` to `stop` for `n` points ``p[:, :n]``; leave s[0], marks m.

    p: rows u, y, z and the signed u; a warp puts rows of the stack in place of them.
    layer: points ``i`` and ``i + layer`` share their y, and the points of a layer
    their z, so that tables over them need not be evaluated for each; n if not.
    """
    top = -1
    straight = p
    bent = False
    for row in range(start, stop):
        op, o, count, selector = code[row, 0], code[row, 1], code[row, 2], code[row, 3]
        if op == 0:  # affine
            top += 1
            c0, cu, cy, cz = c[o], c[o + 1], c[o + 2], c[o + 3]
            r, pu, py, pz = s[top], p[0], p[1], p[2]
            for i in range(n):
                r[i] = c0 + cu * pu[i] + cy * py[i] + cz * pz[i]
        elif op == 1:  # table
            top += 1
            if bent or selector == 0 or layer >= n:
                _table(c, o, count, p[selector], n, s[top])
            else:
                _layered_table(c, o, count, selector, p, n, layer, s[top])
        elif op == 2:  # chain
            top += 1
            _chain(c, o, count, p, n, s[top])
        elif op == 3:  # ellipsoid
            top += 1
            eu, ey, ez = c[o], c[o + 1], c[o + 2]
            iu, iy, iz = c[o + 3], c[o + 4], c[o + 5]
            tiny, steepest = np.float32(1e-6), max(iu, iy, iz)
            for i in range(n):
                a, b, d = (p[0, i] - eu) * iu, (p[1, i] - ey) * iy, (p[2, i] - ez) * iz
                k0 = np.sqrt(a * a + b * b + d * d)
                a, b, d = a * iu, b * iy, d * iz
                k1 = np.sqrt(a * a + b * b + d * d) + tiny * steepest
                s[top, i] = (k0 + tiny) * (k0 - F1) / k1
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
            r, q, k, share = s[top], s[top + 1], c[o], c[o + 1]
            for i in range(n):
                r[i] = _smooth_min(r[i], q[i], k, share)
        elif op == 6:  # smooth maximum
            top -= 1
            r, q, k, share = s[top], s[top + 1], c[o], c[o + 1]
            for i in range(n):
                r[i] = -_smooth_min(-r[i], -q[i], k, share)
        elif op == 7:
            top -= 1
            r, q = s[top], s[top + 1]
            for i in range(n):
                r[i] += q[i]
        elif op == 8:
            top -= 1
            r, q = s[top], s[top + 1]
            for i in range(n):
                r[i] -= q[i]
        elif op == 9:
            top -= 1
            r, q = s[top], s[top + 1]
            for i in range(n):
                r[i] *= q[i]
        elif op == 10:
            r = s[top]
            for i in range(n):
                r[i] = abs(r[i])
        elif op == 11:
            r = s[top]
            for i in range(n):
                r[i] = -r[i]
        elif op == 12:  # noise
            top += 1
            r, q, weight = s[top], noise[selector], c[o]
            for i in range(n):
                r[i] = weight * q[i]
        elif op == 13:  # walls between cells
            top += 1
            _cells(c, o, count, p, n, s[top])
        elif op == 14:  # mark
            r, q = s[top], m[selector]
            for i in range(n):
                q[i] = min(q[i], r[i])
        elif op == 15:  # warp: the three rows of shifts become coordinates
            for axis in range(3):
                r, q = s[top - 2 + axis], p[axis]
                for i in range(n):
                    r[i] += q[i]
            p = s[top - 2 :]
            bent = True
        elif op == 16:  # unwarp: the value takes the place of the coordinates
            r, q = s[top], s[top - 3]
            for i in range(n):
                q[i] = r[i]
            top -= 3
            p = straight
            bent = False
        elif op == 17:  # lateral distance, positive on the right
            top += 1
            r, q = s[top], straight[3]
            for i in range(n):
                r[i] = q[i]
        elif op == 18:  # recall a mark
            top += 1
            r, q = s[top], m[selector]
            for i in range(n):
                r[i] = q[i]


@njit(cache=True, nogil=True, error_model="numpy")
def _gradient_noise(
    x: np.float32, y: np.float32, z: np.float32, perm: Ints, grad: Floats
) -> np.float32:
    """Return Perlin's gradient noise with the quintic fade, period 256 cells."""
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
def grain_at(
    x: np.float32,
    y: np.float32,
    z: np.float32,
    row: int,
    grain: Floats,
    perm: Ints,
    grad: Floats,
) -> np.float32:
    """Sum one row's octaves of the bone's grain at one place; mean 0, deviation 1.

    grain: rows as those of `noise_rows`, without the fade.
    """
    total = F0
    for k in range(grain.shape[0]):
        o = grain[k]
        if int(o[0]) == row:
            total += o[1] * _gradient_noise(
                o[2] * x + o[3] * y + o[4] * z + o[11],
                o[5] * x + o[6] * y + o[7] * z + o[12],
                o[8] * x + o[9] * y + o[10] * z + o[13],
                perm,
                grad,
            )
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def noise_rows(
    p: Floats,
    n: int,
    octaves: Floats,
    limits: Floats,
    perm: Ints,
    grad: Floats,
    out: Floats,
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
def side_points(
    p: Floats, n: int, side: np.float32, septum: Floats, out: Floats
) -> None:
    """Turn RAS points into (u, y, z, x); side 0 gives the distance to the midline."""
    amplitude, y0, iy, z0, iz = septum[0], septum[1], septum[2], septum[3], septum[4]
    for i in range(n):
        a, b = (p[1, i] - y0) * iy, (p[2, i] - z0) * iz
        x = p[0, i] - amplitude * np.float32(math.exp(-(a * a + b * b)))
        out[0, i] = abs(x) if side == F0 else side * x
        out[1, i] = p[1, i]
        out[2, i] = p[2, i]
        out[3, i] = x
