"""The arrays that the kernels take: one head, and what is found at its points."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Bools = NDArray[np.bool_]
Bytes = NDArray[np.uint8]
Shorts = NDArray[np.int16]
Ints = NDArray[np.int32]
Longs = NDArray[np.int64]
Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]


class Tables(NamedTuple):
    """Bundle the arrays that describe one head (`anatomy.phantom.model` fills them).

    code ``(n, 4)``, constants ``(m,)``: the stack programs.
    parts ``(P, 4)``: first instruction, end, side, cavity (0: never opposite).
    reach ``(P, 2)``: Lipschitz constant and noise bound of each part.
    common ``(2,)``: span of the field that only leaves marks.
    spread ``(1 + k, 7)``: how places differ from the average head's, see `displace`.
    septum ``(5,)``: deviation, centre y, 1 / extent y, centre z, 1 / extent z.
    octaves ``(k, 16)``, limits ``(2,)``, perm ``(256,)``, grad ``(256, 3)``: noise.
    grain ``(k, 16)``: octaves of the bone's density, row 0, and its trabeculae, row 1.
    tint ``(r, 4)``: mark row, centre mm, half width mm, blood fraction.
    solids ``(q, 7)``: mark row or -1, half thickness mm (0: solid), HU, label, level
    mm, Lipschitz constant, standard deviation of the grain in HU; ground ``(q, 2)``:
    span of each solid's field.
    plates ``(k, 2)``: span of the zone of each thin plate.
    """

    code: Ints
    constants: Floats
    parts: Ints
    reach: Floats
    common: Ints
    spread: Floats
    septum: Floats
    octaves: Floats
    limits: Floats
    perm: Ints
    grad: Floats
    grain: Floats
    tint: Floats
    solids: Floats
    ground: Ints
    plates: Ints


class Grids(NamedTuple):
    """Bundle the outputs: arrays ``(nz, ny, nx)``, or ``(n,)`` of one block.

    air: least part value, clamped to the band, mm; gap: least value of a part of
    another cavity, mm; part: index of the least part, 255 where none is in the band;
    structure: row of the solid's mark at this place, 255 for none; blood: blood
    fraction, square root scale; skin: skin weight; ground_hu and ground: HU and label
    of what lies behind mucosa and bone shell; plate: index of the thin plate that
    walls are here, 255 for none; density: of the shell's bone, `MEAN_DENSITY` is 1.
    """

    air: Floats
    gap: Floats
    part: Bytes
    structure: Bytes
    blood: Bytes
    skin: Bytes
    ground_hu: Shorts
    ground: Bytes
    plate: Bytes
    density: Bytes


MEAN_DENSITY = 128
"""The value of `Grids.density` for bone of the mean density."""


class Sampling(NamedTuple):
    """Where voxels are, and how near and sharp what they show is.

    origin: ``(3,)`` global lattice index of voxel 0, RAS order x, y, z; the arrays run
    along -x and -y (their world is LPS). spacing: mm of the unscaled head. band: how
    far from the air parts are evaluated, mm. sharp: 1 / (standard deviation of the
    voxel's blur in mm), for the ground's edges.
    """

    origin: Longs
    spacing: float
    band: np.float32
    sharp: np.float32


POINT_ROWS = 12
"""Rows of scratch before the stack: side's point 4, noise 2, point 3, ground 3."""


class Scratch(NamedTuple):
    """Bundle what a thread writes over again and again.

    work: ``(POINT_ROWS + depth, n)``. fresh, kept: ``(rows, n)``, the marks of one
    part and of all so far. parts ``(2, parts)`` and solids ``(2, solids)``: which of
    them may reach the group of bricks, and the brick. flat: the outputs of a brick.
    """

    work: Floats
    fresh: Floats
    kept: Floats
    parts: Bools
    solids: Bools
    flat: Grids


class WallLayers(NamedTuple):
    """Bundle what lies behind the surfaces of the air.

    parts ``(P, 5)``, structures ``(S, 5)``: mucosa mm, bone mm, air label, mucosa
    label, bone label; a structure's row wins over the part's where it has one, but
    structures before `first_open` are solids and do not name the air.
    plates ``(k, 2)``: bone mm and bone label; where a plate is, they win over both,
    and over grounds without a shell.
    ground_kind: by part and ground, bit 0 for grounds that carry no bone shell of
    that part, bit 1 for bone.
    tissue_hu: air, mucosa, bone.
    """

    parts: Doubles
    structures: Doubles
    first_open: int
    plates: Doubles
    ground_kind: Bytes
    tissue_hu: Doubles


class Painted(NamedTuple):
    """CT numbers, labels and bone cover (255 is all bone)."""

    hu: Shorts
    labels: Bytes
    bone_cover: Bytes
