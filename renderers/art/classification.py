"""A transfer function as kernels take it: bins, and what cannot be seen."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from renderers.art.kernels.march_types import Classification
from renderers.scene import Scene, TransferFunction

_BINS = 1024
"""Bins between the first and the last node, at most: 32 kB."""

_DIGITS = 23
"""Of the larger part of a sum: differences of such parts are exact in float32."""


_FAR = 64.0
"""Densities so many spans of the transfer function from zero are brought there first:
nearer, float32 keeps a 260,000th of the span."""

_SLAB = 1 << 22
"""Voxels that are shifted at once."""


def about_zero(scene: Scene) -> Scene:
    """Return the same scene with its densities about zero, where they are far from it.

    Kernels count in float32, whose steps at 1e6 are 1/16. Numbers that are finer than
    that, in float64 or as whole numbers, keep what they have; those that come in
    float32 lose nothing more.
    """
    volume, transfer = scene.volume, scene.transfer_function
    first, last = transfer.nodes[0], transfer.nodes[-1]
    middle = 0.5 * (first + last)
    if not abs(middle) > _FAR * (last - first) > 0.0:
        return scene
    # a power of two: a difference to it rounds nothing
    grain = 2.0 ** math.ceil(math.log2(last - first))
    shift = round(middle / grain) * grain
    values = np.empty(volume.shape, np.float32)
    flat, shifted = np.reshape(volume.values, -1), values.reshape(-1)
    for at in range(0, len(flat), _SLAB):
        here = slice(at, at + _SLAB)
        shifted[here] = flat[here].astype(np.float64) - shift
    return replace(
        scene,
        volume=volume.with_values(values, volume.background - shift),
        transfer_function=replace(transfer, nodes=transfer.nodes - shift),
    )


def clear_intervals(transfer_function: TransferFunction) -> NDArray[np.float32]:
    """Return the intervals of density without any extinction, ``(k, 2)``."""
    nodes = np.concatenate([[-np.inf], transfer_function.nodes, [np.inf]])
    kappa = transfer_function.kappa_per_mm
    kappa = np.concatenate([kappa[:1], kappa, kappa[-1:]])
    intervals: list[list[float]] = []
    for k in np.flatnonzero((kappa[:-1] == 0) & (kappa[1:] == 0)):
        if intervals and intervals[-1][1] == nodes[k]:
            intervals[-1][1] = nodes[k + 1]
        else:
            intervals.append([nodes[k], nodes[k + 1]])
    return np.array(intervals, np.float32).reshape(-1, 2)


def classification(transfer_function: TransferFunction) -> Classification:
    """Lay the user's own nodes behind a table of bins.

    Piecewise linear between exactly the nodes given: a jump stays where it was put.
    A bin's width is a power of two and its ends are multiples of it, so that most nodes
    lie between bins, and float32 finds a density's bin without rounding.
    """
    nodes = transfer_function.nodes
    ends = np.column_stack([transfer_function.color, transfer_function.kappa_per_mm])
    slope = np.diff(ends, axis=0) / np.diff(nodes)[:, None]
    # Before the first and beyond the last node the end values hold.
    base = np.concatenate([ends[:1], ends])
    slope = np.concatenate([np.zeros((1, 4)), slope, np.zeros((1, 4))])
    lower = np.concatenate([[nodes[0]], nodes, [np.inf]])
    finest = np.abs(nodes).max() / (1 << 22)
    width = max((nodes[-1] - nodes[0]) / _BINS, finest, 1e-30)
    width = 2.0 ** math.ceil(math.log2(width))
    low = math.floor(nodes[0] / width) * width
    edges = low + width * np.arange(math.ceil((nodes[-1] - low) / width) + 1)
    color, kappa = transfer_function.evaluate(edges)
    tops = np.column_stack([color, kappa])
    starts = np.concatenate([tops[:1], tops])
    rises = np.concatenate([np.zeros((1, 4)), np.diff(tops, axis=0), np.zeros((1, 4))])
    holds = np.searchsorted(nodes, edges, side="right")[:-1]
    mixed = np.searchsorted(nodes, edges, side="left")[1:] > holds
    starts[1:-1, 3] = np.where(mixed, -1.0, starts[1:-1, 3])
    rises[1:-1, 3] = np.where(mixed, 0.0, rises[1:-1, 3])
    pairs = np.stack([starts, rises], axis=-1)[:, [3, 0, 1, 2]]
    extinction = np.column_stack([lower[:-1], lower[1:], base[:, 3], slope[:, 3]])
    spare = np.zeros((len(base), 1))
    return Classification(
        np.ascontiguousarray(pairs.reshape(-1, 8), np.float32),
        np.float32(low),
        np.float32(1 / width),
        np.float32(len(edges)),
        np.concatenate([[0], holds, [len(nodes)]]).astype(np.int32),
        np.ascontiguousarray(extinction, np.float32),
        np.ascontiguousarray(np.hstack([base[:, :3], spare]), np.float32),
        np.ascontiguousarray(np.hstack([slope[:, :3], spare]), np.float32),
    )


def sums_at_nodes(table: Classification) -> NDArray[np.float32]:
    """Sum extinction, and extinction times colour, over density up to each piece.

    Gives float32 (pieces, 8): extinction, red, green and blue in pairs; the two
    numbers of a pair add up to the sum, to 48 bits of the largest. Equal sums, over
    what is clear, are equal bit for bit.
    """
    lower, upper, kappa, rise = table.extinction.astype(np.float64).T
    # Nothing lies before the first node, and nothing goes on from the last piece.
    width = np.where(np.isfinite(upper), upper - lower, 0.0)
    ends = kappa + rise * width
    color = table.color[:, :3].astype(np.float64)
    color_end = color + table.color_slope[:, :3] * width[:, None]
    mean = 0.5 * (kappa + ends)
    light = mean[:, None] * 0.5 * (color + color_end)
    light += ((ends - kappa) / 12)[:, None] * (color_end - color)
    pieces = np.column_stack([mean, light]) * width[:, None]
    sums = np.concatenate([np.zeros((1, 4)), np.cumsum(pieces, axis=0)[:-1]])
    _, exponent = np.frexp(sums.max(axis=0))
    grain = np.ldexp(1.0, exponent - _DIGITS)
    large = np.rint(sums / grain) * grain
    pairs = np.stack([large, sums - large], axis=-1).astype(np.float32)
    return np.ascontiguousarray(pairs.reshape(-1, 8))
