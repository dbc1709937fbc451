"""The plain, slow, double-precision ray caster that both renderers are judged by.

Nothing is skipped, cut off, tabulated or shared: numpy in float64. It draws mode
`classic`, either with the samples that the ray tracer takes, at the middles of equal
steps, or as exactly as it can.
"""

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from renderers.reference.quadrature import faces, gauss_ray, kinks, steps_between
from renderers.scene import Camera, Scene, Volume
from renderers.scene.deflection import Deflection

_RAYS_AT_ONCE = 1 << 14
"""Bounds the memory of the sample arrays; each ray is independent of the others."""


def render_reference(
    scene: Scene,
    camera: Camera,
    step_mm: float,
    *,
    shaded: bool = True,
    deflection: Deflection | None = None,
    rule: Literal["midpoint", "gauss"] = "midpoint",
) -> NDArray[np.float64]:
    """Cast the camera's rays; return premultiplied linear RGBA, ``(h, w, 4)``.

    Each ray's way through the interpolable box is cut into ``n = ceil(length / step)``
    equal segments, sampled at their middles: the midpoint rule, second order in
    `step_mm`, for the emission-absorption integral (Max, IEEE TVCG 1995;1:99).
    shaded: False leaves out the lights and uses the transfer function's colours.
    deflection: bends the rays; samples are taken where they lead, lengths are those of
        the straight ray.
    rule: "gauss" cuts rays at faces of voxels and where the density passes a node of
        the transfer function, into steps no longer than `step_mm`, with two Gauss
        points each: fourth order, jumps included; 1e-9 in the scenes with closed forms
        (`renderers.reference.quadrature`). One ray after the other: slow.
    """
    if not (math.isfinite(step_mm) and step_mm > 0):
        raise ValueError(f"step must be a positive length in mm, got {step_mm!r}")
    origins, directions = (a.reshape(-1, 3) for a in camera.rays())
    gradient = sobel_gradient(scene.volume) if shaded else None
    if rule == "gauss":
        if deflection is not None and deflection.deflectors:
            raise ValueError(
                "bent rays have kinks that rule gauss does not know; take rule midpoint"
            )
        pixels = [
            _cast_exactly(scene, origin, way, step_mm, gradient)
            for origin, way in zip(origins, directions, strict=True)
        ]
        return np.array(pixels).reshape(camera.height, camera.width, 4)
    bent = deflection or Deflection()
    result = np.zeros((len(origins), 4))
    for first in range(0, len(origins), _RAYS_AT_ONCE):
        some = slice(first, first + _RAYS_AT_ONCE)
        result[some] = _cast(
            scene, origins[some], directions[some], step_mm, gradient, bent
        )
    return result.reshape(camera.height, camera.width, 4)


def box_interval(
    volume: Volume, origins: NDArray[np.float64], directions: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Find where rays ``(n, 3)`` enter and leave the interpolable box, mm.

    The interval starts at the eye when that is inside, and has ``near >= far`` for
    rays that miss.
    """
    matrix = volume.voxel_from_world
    start = origins @ matrix[:3, :3].T + matrix[:3, 3]
    rate = directions @ matrix[:3, :3].T
    top = np.array(volume.shape[::-1]) - 1
    parallel = np.abs(rate) < 1e-12
    safe = np.where(parallel, 1.0, rate)
    a, b = -start / safe, (top - start) / safe
    inside = (start >= 0) & (start <= top)
    low = np.where(parallel, np.where(inside, -np.inf, np.inf), np.minimum(a, b))
    high = np.where(parallel, np.inf, np.maximum(a, b))
    near, far = np.maximum(low.max(axis=-1), 0.0), high.min(axis=-1)
    unseen = np.linalg.norm(directions, axis=-1) < 0.5
    return near, np.where(unseen, 0.0, far)


def sobel_gradient(volume: Volume) -> NDArray[np.float64]:
    """Estimate the gradient at each voxel, ``(nz, ny, nx, 3)``, world frame, per mm.

    Sobel over the 26 neighbours; on the volume's faces a one-sided difference, and
    the outermost voxel stands for its missing neighbours.
    """
    values = volume.values.astype(np.float64)
    padded = np.pad(values, 1, mode="edge")
    result = np.zeros((*values.shape, 3))
    for component, axis in enumerate((2, 1, 0)):
        size = values.shape[axis]
        smooth = padded
        for other in range(3):
            if other != axis:
                n = values.shape[other]
                low, middle, high = (
                    np.take(smooth, range(k, k + n), axis=other) for k in range(3)
                )
                smooth = (low + 2 * middle + high) / 4
        difference = np.take(smooth, range(2, size + 2), axis=axis) - np.take(
            smooth, range(size), axis=axis
        )
        width = np.full(size, 2.0)
        width[[0, -1]] = 1.0
        shape = [1, 1, 1]
        shape[axis] = size
        width_mm = width.reshape(shape) * volume.spacing_mm[component]
        result[..., component] = difference / width_mm
    rotated: NDArray[np.float64] = result @ volume.direction.T
    return rotated


def _cast(
    scene: Scene,
    origins: NDArray[np.float64],
    directions: NDArray[np.float64],
    step_mm: float,
    gradient: NDArray[np.float64] | None,
    deflection: Deflection,
) -> NDArray[np.float64]:
    near, far = box_interval(scene.volume, origins, directions)
    length = np.where(far > near, far - near, 0.0)
    count = np.ceil(length / step_mm).astype(np.int64)
    h = length / np.maximum(count, 1)
    color = np.zeros((len(origins), 3))
    clear = np.ones(len(origins))
    low, high = scene.volume.value_range
    for i in range(int(count.max(initial=0))):
        on = np.flatnonzero(i < count)
        t = near[on] + (i + 0.5) * h[on]
        points = origins[on] + t[:, None] * directions[on]
        places = deflection.pull_back(points)
        # Rounding must not put a sample of the box outside it.
        radiance, kappa = scene.transfer_function.evaluate(
            _interpolate(scene.volume, scene.volume.values[..., None], places)[:, 0]
        )
        kappa[deflection.opening(points) < 0] = 0
        if gradient is not None:
            slope = _interpolate(scene.volume, gradient, places)
            slope = np.einsum("nji,nj->ni", deflection.jacobian(points), slope)
            radiance = _shade(
                scene, radiance, slope, points, directions[on], 1e-6 * (high - low)
            )
        weight = clear[on] * -np.expm1(-kappa * h[on])
        color[on] += weight[:, None] * radiance
        clear[on] -= weight
    return np.column_stack([color, 1 - clear])


def _cast_exactly(
    scene: Scene,
    origin: NDArray[np.float64],
    way: NDArray[np.float64],
    step_mm: float,
    gradient: NDArray[np.float64] | None,
) -> NDArray[np.float64]:
    """Return one pixel by rule gauss, ``(4,)``."""
    volume = scene.volume
    (near,), (far,) = box_interval(volume, origin[None], way[None])
    if not near < far:
        return np.zeros(4)
    low, high = volume.value_range

    def density(t: NDArray[np.float64]) -> NDArray[np.float64]:
        points = origin + t[:, None] * way
        return _interpolate(volume, volume.values[..., None], points)[:, 0]

    def medium(
        t: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        points = origin + t[:, None] * way
        color, kappa = scene.transfer_function.evaluate(density(t))
        if gradient is not None:
            slope = _interpolate(volume, gradient, points)
            ways = np.broadcast_to(way, points.shape)
            color = _shade(scene, color, slope, points, ways, 1e-6 * (high - low))
        return color, kappa

    matrix = volume.voxel_from_world
    start = matrix[:3, :3] @ origin + matrix[:3, 3]
    ends = faces(start, matrix[:3, :3] @ way, near, far)
    bends = kinks(density, ends, scene.transfer_function.nodes)
    cuts = steps_between(np.unique(np.concatenate([ends, bends])), step_mm)
    light, clear = gauss_ray(medium, cuts)
    return np.append(light, 1 - clear)


def _interpolate(
    volume: Volume, channels: NDArray[np.float64], points: NDArray[np.float64]
) -> NDArray[np.float64]:
    matrix = volume.voxel_from_world
    top = np.array(volume.shape[::-1]) - 1
    voxel = np.clip(points @ matrix[:3, :3].T + matrix[:3, 3], 0, top)
    base = np.minimum(voxel.astype(np.int64), top - 1)
    f = voxel - base
    result = np.zeros((len(points), channels.shape[-1]))
    for corner in range(8):
        d = np.array([corner & 1, corner >> 1 & 1, corner >> 2])
        weight = np.prod(np.where(d, f, 1 - f), axis=-1)
        i, j, k = (base + d).T
        result += weight[:, None] * channels[k, j, i]
    return result


def _shade(
    scene: Scene,
    color: NDArray[np.float64],
    slope: NDArray[np.float64],
    points: NDArray[np.float64],
    directions: NDArray[np.float64],
    least: float,
) -> NDArray[np.float64]:
    """Light samples whose gradient exceeds `least`; the others keep their colour."""
    steep = np.linalg.norm(slope, axis=-1)
    has_normal = steep > max(least, 1e-30)
    normal = -slope / np.where(has_normal, steep, 1.0)[:, None]
    material = scene.material
    diffuse = np.full_like(color, material.ambient)
    glint = np.zeros_like(color)
    for light in scene.lights:
        to_light = light.vector - points if light.is_local else light.vector
        to_light = np.broadcast_to(to_light, points.shape)
        to_light = to_light / np.linalg.norm(to_light, axis=-1, keepdims=True)
        cosine = np.maximum(np.sum(normal * to_light, axis=-1), 0)
        diffuse += material.diffuse * cosine[:, None] * light.color
        if material.specular > 0:
            half = to_light - directions
            half = half / np.maximum(np.linalg.norm(half, axis=-1, keepdims=True), 1e-6)
            cosine = np.maximum(np.sum(normal * half, axis=-1), 0)
            power = cosine**material.shininess
            glint += material.specular * power[:, None] * light.color
    return np.where(has_normal[:, None], color * diffuse + glint, color)
