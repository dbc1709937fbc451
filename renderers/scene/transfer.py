"""From density to colour and extinction.

Extinction ``kappa`` in 1/mm is the primary quantity. An opacity per reference length
is converted once, by ``kappa = -log1p(-opacity) / length``; the opacity of a segment
is ``-expm1(-kappa * length)``, which keeps small opacities that ``1 - (1 - a)**n``
in float32 loses altogether.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from system import UserError

MAX_OPACITY = 1.0 - 2.0**-24
"""The largest opacity per reference length: one float32 step below opaque, so that
extinction stays finite and a segment of length zero stays transparent."""


def extinction_from_opacity(
    opacity: NDArray[np.float64], reference_mm: float
) -> NDArray[np.float64]:
    """Convert opacity per `reference_mm` to extinction in 1/mm."""
    if not reference_mm > 0:
        raise UserError(f"reference length must be positive, got {reference_mm} mm")
    given = np.asarray(opacity, dtype=np.float64)
    if not np.all((given >= 0) & (given <= 1)):
        raise UserError(f"opacity must be from 0 to 1, got {given}")
    return -np.log1p(-np.minimum(given, MAX_OPACITY)) / reference_mm


def _parted(nodes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Put the first of two equal nodes lower, by what float32 can tell apart."""
    jumps = np.flatnonzero(np.diff(nodes) == 0)
    least = 1e-6 * float(np.abs(nodes).max()) or 1e-6
    at = np.maximum(np.abs(nodes[jumps]), least).astype(np.float32)
    nodes[jumps] -= np.spacing(at)
    return nodes


@dataclass(frozen=True, slots=True)
class TransferFunction:
    """Map density to linear colour and extinction, piecewise linearly.

    nodes: ``(n,)`` increasing densities. Two may be equal: there the function jumps,
        and has what the second says; the first is put a hair lower.
    color: ``(n, 3)`` linear RGB, not multiplied by opacity.
    kappa_per_mm: ``(n,)`` extinction, zero where the medium is clear.
    Beyond the first and last node the end values hold.
    """

    nodes: NDArray[np.float64]
    color: NDArray[np.float64]
    kappa_per_mm: NDArray[np.float64]

    def __post_init__(self) -> None:
        nodes = np.array(self.nodes, dtype=np.float64)
        color = np.array(self.color, dtype=np.float64)
        kappa = np.array(self.kappa_per_mm, dtype=np.float64)
        if nodes.ndim == 1 and len(nodes) > 1 and np.all(np.isfinite(nodes)):
            nodes = _parted(nodes)
        if nodes.ndim != 1 or len(nodes) < 2 or not np.all(np.diff(nodes) > 0):
            raise UserError(
                "transfer function nodes must increase strictly, but for two at a "
                f"jump: {self.nodes}"
            )
        if color.shape != (len(nodes), 3) or kappa.shape != nodes.shape:
            raise UserError(
                f"{len(nodes)} nodes need colour {(len(nodes), 3)} and extinction "
                f"{nodes.shape}, got {color.shape} and {kappa.shape}"
            )
        finite = all(np.all(np.isfinite(a)) for a in (nodes, color, kappa))
        if not finite or np.any(kappa < 0) or np.any(color < 0):
            raise UserError("transfer function values must be finite and not negative")
        for name, array in (("nodes", nodes), ("color", color), ("kappa", kappa)):
            array.flags.writeable = False
            object.__setattr__(self, "kappa_per_mm" if name == "kappa" else name, array)

    @classmethod
    def from_opacity(
        cls,
        nodes: NDArray[np.float64],
        color: NDArray[np.float64],
        opacity: NDArray[np.float64],
        reference_mm: float,
    ) -> "TransferFunction":
        """Build from opacities per `reference_mm`."""
        return cls(nodes, color, extinction_from_opacity(opacity, reference_mm))

    def evaluate(
        self, density: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return colour ``(..., 3)`` and extinction ``(...)`` at any densities."""
        d = np.asarray(density, dtype=np.float64)
        color = np.stack(
            [np.interp(d, self.nodes, self.color[:, c]) for c in range(3)], axis=-1
        )
        return color, np.interp(d, self.nodes, self.kappa_per_mm)

    def table(self, low: float, high: float, size: int) -> NDArray[np.float32]:
        """Sample ``(size, 4)`` float32 rows (r, g, b, kappa) over ``[low, high]``.

        Row i belongs to density ``low + i * (high - low) / (size - 1)``.
        """
        if not (high > low and size >= 2):
            raise UserError(f"cannot tabulate {size} rows over [{low}, {high}]")
        color, kappa = self.evaluate(np.linspace(low, high, size))
        return np.concatenate([color, kappa[:, None]], axis=1).astype(np.float32)

    def is_clear(self, low: float, high: float) -> bool:
        """Return whether no density in ``[low, high]`` has any extinction."""
        inside = (self.nodes > low) & (self.nodes < high)
        ends = np.interp([low, high], self.nodes, self.kappa_per_mm)
        return not (np.any(self.kappa_per_mm[inside] > 0) or np.any(ends > 0))
