"""Splats of mode `classic`: projection, shading, compositing back to front."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
I16 = NDArray[np.int16]
U16 = NDArray[np.uint16]

RECORD = 9
"""Floats of a projected splat: pixel centre 0-1, inverse covariance xx, xy, yy 2-4,
colour 5-7, opacity at the centre 8."""

ANTIALIAS = 0.3
"""Squared pixels added to a footprint's covariance, so that small ones keep mass."""

_EDGE = math.exp(-4.5)
_UNDEFINED = -32768


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _decode(octahedral: I16, s: int) -> tuple[float, float, float]:
    """Unpack a normal; zeros where the gradient vanished."""
    if octahedral[s, 0] == _UNDEFINED:
        return 0.0, 0.0, 0.0
    x = octahedral[s, 0] / 32767.0
    y = octahedral[s, 1] / 32767.0
    z = 1.0 - abs(x) - abs(y)
    if z < 0:
        a = (1.0 - abs(y)) * (1.0 if x >= 0 else -1.0)
        y = (1.0 - abs(x)) * (1.0 if y >= 0 else -1.0)
        x = a
    r = 1.0 / math.sqrt(x * x + y * y + z * z)
    return x * r, y * r, z * r


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _jacobian(
    x: float, y: float, z: float, projection: int, scale: float, width: int,
    height: int,
) -> tuple[Any, ...]:  # fmt: skip
    """Give pixel, inverse pixel area per mm^2 and the 2x3 pixels-per-mm matrix."""
    rho = math.sqrt(x * x + y * y)
    cx, cy = (x / rho, y / rho) if rho > 1e-9 else (1.0, 0.0)
    if projection == 0:
        d2 = rho * rho + z * z
        r = scale * math.atan2(rho, z)
        rr, rz = scale * z / d2, -scale * rho / d2
        tt = r / rho if rho > 1e-6 else scale / math.sqrt(d2)
        area = scale / math.sqrt(d2) * tt
    elif projection == 1:
        r = scale * rho / z
        rr, rz, tt = scale / z, -scale * rho / (z * z), scale / z
        # seen along the oblique ray, radially stretched by 1 / cos^2
        area = tt * math.sqrt(rr * rr + rz * rz)
    else:
        r = scale * rho
        rr, rz, tt = scale, 0.0, scale
        area = scale * scale
    return (
        0.5 * width + r * cx,
        0.5 * height - r * cy,
        area,
        cx * cx * rr + cy * cy * tt,
        cx * cy * (rr - tt),
        cx * rz,
        -cx * cy * (rr - tt),
        -cy * cy * rr - cx * cx * tt,
        -cy * rz,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def project_splats(
    index: I32, row: I32, x: U16, octahedral: I16, value: F32, ny: int,
    camera_from_voxel: F64, frame: F64, volume_mm3: float, sigma: float,
    projection: int, extent: float, width: int, height: int, table: F32,
    table_low: float, table_scale: float, peaks: F32, lights: F64, ambient: float,
    diffuse: float, points: bool, records: F32, boxes: I32,
) -> int:  # fmt: skip
    """Write records and pixel boxes (x0, x1, y0, y1) of the splats that may show.

    camera_from_voxel: ``(3, 4)`` float64. table: ``(m, 4)`` colour and extinction
    over densities. lights: ``(l, 7)`` vector, colour, 1 if local. points: constant
    squares of one projected voxel instead of Gaussians. Returns their number.
    """
    half = 0.5 * min(width, height)
    scale = half / math.tan(extent) if projection == 1 else half / extent
    m = camera_from_voxel
    n = 0
    for e in range(index.shape[0]):
        s = index[e]
        i = float(x[s])
        j = float(row[e] % ny)
        k = float(row[e] // ny)
        px = m[0, 0] * i + m[0, 1] * j + m[0, 2] * k + m[0, 3]
        py = m[1, 0] * i + m[1, 1] * j + m[1, 2] * k + m[1, 3]
        pz = m[2, 0] * i + m[2, 1] * j + m[2, 2] * k + m[2, 3]
        if projection == 1 and pz <= 1e-6:
            continue
        u, v, area, a0, a1, a2, b0, b1, b2 = _jacobian(
            px, py, pz, projection, scale, width, height
        )
        xx = 0.0
        xy = 0.0
        yy = 0.0
        for c in range(3):
            p = a0 * m[0, c] + a1 * m[1, c] + a2 * m[2, c]
            q = b0 * m[0, c] + b1 * m[1, c] + b2 * m[2, c]
            xx += p * p
            xy += p * q
            yy += q * q
        # pixels of one projected voxel; a lattice has this area per splat
        cell = math.sqrt(max(xx * yy - xy * xy, 1e-30))
        if projection != 2:
            # a footprint more than half its distance wide has no linear projection
            d2 = px * px + py * py + pz * pz
            if sigma * sigma * cell > 0.25 * d2 * area:
                continue
        t = (value[s] - table_low) * table_scale + 0.5
        c = min(max(int(t), 0), table.shape[0] - 1)
        tau = table[c, 3] * volume_mm3 * area / cell
        if points:
            side = max(math.sqrt(cell), 1.0)
            alpha = -math.expm1(-tau * cell / (side * side))
            x0 = math.ceil(u - 0.5 * side - 0.5)
            x1 = math.ceil(u + 0.5 * side - 0.5) - 1.0
            y0 = math.ceil(v - 0.5 * side - 0.5)
            y1 = math.ceil(v + 0.5 * side - 0.5) - 1.0
            det = 1.0
        else:
            before = sigma * sigma * cell
            xx = sigma * sigma * xx + ANTIALIAS
            yy = sigma * sigma * yy + ANTIALIAS
            xy = sigma * sigma * xy
            det = xx * yy - xy * xy
            share = -math.expm1(-tau * before / math.sqrt(det)) * (len(peaks) - 1)
            b = min(int(share), len(peaks) - 2)
            alpha = peaks[b] + (share - b) * (peaks[b + 1] - peaks[b])
            x0 = math.ceil(u - 3.0 * math.sqrt(xx) - 0.5)
            x1 = math.floor(u + 3.0 * math.sqrt(xx) - 0.5)
            y0 = math.ceil(v - 3.0 * math.sqrt(yy) - 0.5)
            y1 = math.floor(v + 3.0 * math.sqrt(yy) - 0.5)
        x0 = max(x0, 0.0)
        x1 = min(x1, width - 1.0)
        y0 = max(y0, 0.0)
        y1 = min(y1, height - 1.0)
        if not (x0 <= x1 and y0 <= y1 and alpha > 0):
            continue
        nx, ny_, nz = _decode(octahedral, s)
        lit_r = ambient
        lit_g = ambient
        lit_b = ambient
        if nx == 0 and ny_ == 0 and nz == 0:
            # no normal, no shading: the plain colour
            lit_r = lit_g = lit_b = 1.0
        else:
            for light in range(lights.shape[0]):
                lx, ly, lz = lights[light, 0], lights[light, 1], lights[light, 2]
                if lights[light, 6] > 0:
                    lx -= (
                        frame[0, 0]
                        + px * frame[1, 0]
                        + py * frame[2, 0]
                        + pz * frame[3, 0]
                    )
                    ly -= (
                        frame[0, 1]
                        + px * frame[1, 1]
                        + py * frame[2, 1]
                        + pz * frame[3, 1]
                    )
                    lz -= (
                        frame[0, 2]
                        + px * frame[1, 2]
                        + py * frame[2, 2]
                        + pz * frame[3, 2]
                    )
                    r = 1.0 / max(math.sqrt(lx * lx + ly * ly + lz * lz), 1e-9)
                    lx *= r
                    ly *= r
                    lz *= r
                f = diffuse * max(nx * lx + ny_ * ly + nz * lz, 0.0)
                lit_r += f * lights[light, 3]
                lit_g += f * lights[light, 4]
                lit_b += f * lights[light, 5]
        boxes[n, 0] = int(x0)
        boxes[n, 1] = int(x1)
        boxes[n, 2] = int(y0)
        boxes[n, 3] = int(y1)
        record = records[n]
        record[0] = u
        record[1] = v
        record[2] = yy / det
        record[3] = -xy / det
        record[4] = xx / det
        record[5] = table[c, 0] * lit_r
        record[6] = table[c, 1] * lit_g
        record[7] = table[c, 2] * lit_b
        record[8] = alpha
        n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def draw_band(
    records: F32, boxes: I32, items: I32, points: bool, y_first: int, y_end: int,
    weights: F32, image: F32,
) -> int:  # fmt: skip
    """Composite a band's splats in the order given, over what is there.

    weights: scratch of one row. image: ``(h, w * 4)`` premultiplied RGBA. Returns
    the fragments.
    """
    fragments = 0
    one = np.float32(1)
    for n in range(items.shape[0]):
        s = items[n]
        record = records[s]
        x0 = boxes[s, 0]
        run = boxes[s, 1] - x0 + 1
        y0 = max(boxes[s, 2], y_first)
        y1 = min(boxes[s, 3], y_end - 1)
        red, green, blue, alpha = record[5], record[6], record[7], record[8]
        if points:
            for i in range(run):
                weights[i] = alpha
        left = np.float32(x0) + np.float32(0.5) - record[0]
        a, b, c = record[2], record[3], record[4]
        gain = alpha / np.float32(1 - _EDGE)
        fragments += run * max(y1 - y0 + 1, 0)
        for y in range(y0, y1 + 1):
            if not points:
                dy = np.float32(y) + np.float32(0.5) - record[1]
                for i in range(run):
                    dx = left + np.float32(i)
                    r2 = a * dx * dx + np.float32(2) * b * dx * dy + c * dy * dy
                    # exp(-r2 / 2) as the eighth power of a short series: no table,
                    # no call, so the loop becomes vectors; relative error 3e-6
                    z = max(r2 * np.float32(-1 / 16), np.float32(-0.57))
                    g = one + z * (
                        one
                        + z * (np.float32(1 / 2) + z * (
                            np.float32(1 / 6) + z * (
                                np.float32(1 / 24) + z * (
                                    np.float32(1 / 120) + z * np.float32(1 / 720)))))
                    )  # fmt: skip
                    g = g * g
                    g = g * g
                    g = g * g
                    weights[i] = max(g - np.float32(_EDGE), np.float32(0)) * gain
            line = image[y, 4 * x0 : 4 * (x0 + run)]
            for i in range(run):
                w = weights[i]
                line[4 * i] += w * (red - line[4 * i])
                line[4 * i + 1] += w * (green - line[4 * i + 1])
                line[4 * i + 2] += w * (blue - line[4 * i + 2])
                line[4 * i + 3] += w * (one - line[4 * i + 3])
    return fragments
