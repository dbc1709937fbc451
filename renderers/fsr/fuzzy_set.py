"""The fuzzy voxel set of the 1995 splatter (paper, section 2).

A transfer function F(gradient magnitude, density) -> t says how much a voxel
contributes to the picture; voxels with t at or above a threshold make the set. With F
the projection onto density this is thresholding. Each voxel keeps its grid position,
the normal from its twenty-six neighbours, its density and its t.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.extract_splats import Elements, InclusionTable, extract_rows
from renderers.fsr.kernels.gradients import FlatVolume
from renderers.fsr.sobel_normals import decode_normals, flat_volume
from renderers.fsr.sparse_rows import SparseRows
from renderers.scene import Scene, TransferFunction, Volume

TABLE_DENSITIES = 1024
TABLE_GRADIENTS = 64

BOUNDARY_THRESHOLD = 0.1
"""Default threshold: boundary opacity a splat needs to be worth drawing."""

BOUNDARY_SLOPE_SHARE = 0.25
"""Default boundary slope: this share of the transfer function's density range per
mm. A tissue-air edge spreads its 1000 HU over about one millimetre."""


@dataclass(frozen=True, slots=True)
class Inclusion:
    """F as a table, bilinear between its nodes; end values hold beyond.

    table: ``(g, d)`` float32, rows over gradient magnitudes 0..`gradient_top` (per
        mm), columns over densities `density_low`..`density_high`.
    """

    table: NDArray[np.float32]
    density_low: float
    density_high: float
    gradient_top: float

    def __post_init__(self) -> None:
        table = np.array(self.table, dtype=np.float32)
        if table.ndim != 2 or min(table.shape) < 2 or not np.all(np.isfinite(table)):
            raise ValueError(
                f"an inclusion table needs two finite axes of at least 2, got shape "
                f"{table.shape}"
            )
        if not (self.density_high > self.density_low and self.gradient_top > 0):
            raise ValueError(
                f"inclusion ranges must not be empty: densities {self.density_low} to "
                f"{self.density_high}, gradients to {self.gradient_top}"
            )
        table.flags.writeable = False
        object.__setattr__(self, "table", table)

    @classmethod
    def from_function(
        cls,
        function: Callable[
            [NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]
        ],
        density_range: tuple[float, float],
        gradient_top: float,
    ) -> "Inclusion":
        """Tabulate ``function(gradient_magnitude, density)`` (broadcast arrays).

        Raises ValueError where it gives another shape, or no finite numbers.
        """
        gradients = np.linspace(0, gradient_top, TABLE_GRADIENTS)[:, None]
        densities = np.linspace(*density_range, TABLE_DENSITIES)[None, :]
        shape = TABLE_GRADIENTS, TABLE_DENSITIES
        table = np.asarray(function(gradients, densities))
        if table.shape not in ((), (1, 1), (shape[0], 1), (1, shape[1]), shape):
            raise ValueError(
                f"an inclusion function is given gradients {gradients.shape} and "
                f"densities {densities.shape}; it must give {shape}, got {table.shape}"
            )
        if not (table.dtype.kind in "fiub" and np.all(np.isfinite(table))):
            raise ValueError(
                "an inclusion function must give finite numbers for all gradients to "
                f"{gradient_top:g} and densities {density_range[0]:g} to "
                f"{density_range[1]:g}"
            )
        filled = np.broadcast_to(table, shape).astype(np.float32)
        return cls(filled, *density_range, gradient_top)

    @classmethod
    def density(cls, low: float, high: float) -> "Inclusion":
        """Project onto density: the threshold is then a density in [low, high]."""
        return cls(np.array([[low, high]] * 2, np.float32), low, high, 1.0)

    @classmethod
    def opacity(cls, transfer: TransferFunction, length_mm: float) -> "Inclusion":
        """Take the opacity over `length_mm` (a voxel): all that is not clear."""
        return cls._opacity(transfer, length_mm, None)

    @classmethod
    def boundary(
        cls, transfer: TransferFunction, length_mm: float, slope: float
    ) -> "Inclusion":
        """Weigh opacity by min(gradient / slope, 1): surfaces, not their inside.

        slope: density per mm at which a boundary counts fully.
        """
        if not slope > 0:
            raise ValueError(f"a boundary's slope must be positive, got {slope}")
        return cls._opacity(transfer, length_mm, slope)

    @classmethod
    def _opacity(
        cls, transfer: TransferFunction, length_mm: float, slope: float | None
    ) -> "Inclusion":
        def opacity(
            gradient: NDArray[np.float64], density: NDArray[np.float64]
        ) -> NDArray[np.float64]:
            _, kappa = transfer.evaluate(density)
            result: NDArray[np.float64] = -np.expm1(-kappa * length_mm)
            return result if slope is None else result * gradient / slope

        nodes = transfer.nodes
        ends = (float(nodes[0]), float(nodes[-1]))
        return cls.from_function(opacity, ends, 1.0 if slope is None else slope)


@dataclass(frozen=True, slots=True)
class FuzzySet:
    """The splats of a volume in slices of sparse rows.

    octahedral: ``(n, 2)`` int16 normals (to lower density); undefined where the
        gradient vanishes. value: ``(n,)`` float32 densities. inclusion: ``(n,)``
        float32, each splat's t.
    """

    rows: SparseRows
    octahedral: NDArray[np.int16]
    value: NDArray[np.float32]
    inclusion: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.rows)

    def normals(self) -> NDArray[np.float32]:
        """Return ``(n, 3)`` unit world normals, zero where undefined."""
        return decode_normals(self.octahedral)


def default_inclusion(scene: Scene) -> Inclusion:
    """Choose opaque boundaries, by the scene's transfer function and spacing."""
    nodes = scene.transfer_function.nodes
    slope = BOUNDARY_SLOPE_SHARE * float(nodes[-1] - nodes[0])
    length_mm = float(scene.volume.spacing_mm.min())
    return Inclusion.boundary(scene.transfer_function, length_mm, slope)


def extract_fuzzy_set(
    volume: Volume | Scene,
    inclusion: Inclusion | None = None,
    threshold: float | None = None,
) -> FuzzySet:
    """Collect the voxels with F(gradient magnitude, density) >= `threshold`.

    volume: or a scene, which may go alone: its opaque boundaries are collected, as
    `FuzzySetRenderer` shows them. Raises ValueError when the threshold or a voxel is
    not finite, TypeError when a volume comes without inclusion or threshold.
    """
    if isinstance(volume, Scene):
        if inclusion is None:
            inclusion = default_inclusion(volume)
            threshold = BOUNDARY_THRESHOLD if threshold is None else threshold
        volume = volume.volume
    if not isinstance(volume, Volume) or inclusion is None or threshold is None:
        raise TypeError(
            f"a {type(volume).__name__} does not say by itself which voxels to show: "
            "call extract_fuzzy_set(Scene(volume, transfer_function)), or "
            "extract_fuzzy_set(volume, inclusion, threshold)"
        )
    _refuse_no_numbers(volume)
    if not np.isfinite(threshold):
        raise ValueError(f"the inclusion threshold must be finite, got {threshold}")
    nz, ny, _ = volume.shape
    offsets = np.zeros(nz * ny + 1, np.int64)
    flat = flat_volume(volume)
    x, octahedral, value, share = _extract(
        flat, inclusion, threshold, 0, nz * ny, offsets
    )
    rows = SparseRows(volume.shape, volume.world_from_voxel, offsets, x.copy())
    return FuzzySet(rows, octahedral.copy(), value.copy(), share.copy())


def update_fuzzy_set(
    fuzzy_set: FuzzySet,
    volume: Volume,
    inclusion: Inclusion,
    threshold: float,
    low: tuple[int, int, int],
    high: tuple[int, int, int],
) -> FuzzySet:
    """Extract anew where a volume has changed: in voxels (k, j, i) low..high - 1.

    Equal to extracting the whole changed volume. Neighbours of changed voxels have
    other normals, so the rows next to them are taken anew as well. Raises ValueError
    when the set is of another grid or a voxel is not finite.
    """
    _refuse_no_numbers(volume)
    nz, ny, _ = volume.shape
    if fuzzy_set.rows.shape != volume.shape:
        raise ValueError(
            f"a set of grid {fuzzy_set.rows.shape} cannot be updated from a volume of "
            f"{volume.shape}"
        )
    top, bottom = max(low[1] - 1, 0), min(high[1] + 1, ny)
    old = fuzzy_set.rows.offsets
    counts = np.diff(old)
    arrays = fuzzy_set.rows.x, fuzzy_set.octahedral, fuzzy_set.value
    before = Elements(*arrays, fuzzy_set.inclusion)
    parts: list[Elements] = []
    slices = range(max(low[0] - 1, 0), min(high[0] + 1, nz))
    flat = _flat_slices(volume, slices)
    kept = 0
    for k in slices:
        first, end = k * ny + top, k * ny + bottom
        if end <= first:
            continue
        offsets = np.zeros(nz * ny + 1, np.int64)
        anew = _extract(flat, inclusion, threshold, first, end, offsets)
        counts[first:end] = np.diff(offsets[first : end + 1])
        parts += [_piece(before, kept, int(old[first])), anew]
        kept = int(old[end])
    parts.append(_piece(before, kept, len(fuzzy_set)))
    x, octahedral, value, share = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    offsets = np.concatenate([[0], np.cumsum(counts)])
    rows = SparseRows(volume.shape, volume.world_from_voxel, offsets, x)
    return FuzzySet(rows, octahedral, value, share)


def _flat_slices(volume: Volume, slices: range) -> FlatVolume:
    """Return a volume of which only some slices and their neighbours are converted."""
    if volume.values.dtype == np.float32 or len(slices) == 0:
        return flat_volume(volume)
    values = np.empty(volume.shape, np.float32)
    here = slice(max(slices.start - 1, 0), slices.stop + 1)
    values[here] = volume.values[here]
    return flat_volume(volume.with_values(values, volume.background))


def _refuse_no_numbers(volume: Volume) -> None:
    """Raise ValueError for voxels that are no finite numbers: none has a place in F."""
    if volume.values.dtype.kind == "f" and not np.all(np.isfinite(volume.value_range)):
        count = np.count_nonzero(~np.isfinite(volume.values))
        raise ValueError(
            f"{count} of {volume.values.size} voxels are not finite; replace them, say "
            f"by the background {volume.background:g}, before extraction"
        )


def _piece(elements: Elements, first: int, end: int) -> Elements:
    x, octahedral, value, share = elements
    return Elements(
        x[first:end], octahedral[first:end], value[first:end], share[first:end]
    )


def _extract(
    volume: FlatVolume,
    inclusion: Inclusion,
    threshold: float,
    first: int,
    end: int,
    offsets: NDArray[np.int64],
) -> Elements:
    """Collect the elements of rows first..end - 1, numbered from zero."""
    gradients, densities = inclusion.table.shape
    span = inclusion.density_high - inclusion.density_low
    table = InclusionTable(
        inclusion.table,
        inclusion.table.max(axis=0),
        np.float32(inclusion.density_low),
        np.float32((densities - 1) / span),
        np.float32((gradients - 1) / inclusion.gradient_top),
        np.float32(threshold),
    )
    size = max(16 * volume.nx, (end - first) * volume.nx // 4)
    elements = Elements(
        np.empty(size, np.uint16),
        np.empty((size, 2), np.int16),
        np.empty(size, np.float32),
        np.empty(size, np.float32),
    )
    row = first
    while row < end:
        row = extract_rows(
            volume, table, row, end, offsets, int(offsets[row]), elements
        )
        if row < end:
            x, octahedral, value, share = elements
            elements = Elements(
                np.concatenate([x, np.empty_like(x)]),
                np.concatenate([octahedral, np.empty_like(octahedral)]),
                np.concatenate([value, np.empty_like(value)]),
                np.concatenate([share, np.empty_like(share)]),
            )
    return _piece(elements, 0, int(offsets[end]))
