"""The arrays that kernels take: one head, and what is found at its points."""

from typing import Any, NamedTuple


class Tables(NamedTuple):
    """Bundle the arrays that describe one head (`anatomy.phantom.model` fills them).

    code ``(n, 4)`` int32, constants ``(m,)``: the stack programs.
    parts ``(P, 4)`` int32: first instruction, end, side, cavity (0: never opposite).
    reach ``(P, 2)``: Lipschitz constant and noise bound of each part.
    common ``(2,)`` int32: span of the field that only leaves marks.
    septum ``(5,)``: deviation, centre y, 1 / extent y, centre z, 1 / extent z.
    octaves ``(k, 16)``, limits ``(2,)``, perm ``(256,)``, grad ``(256, 3)``: noise.
    tint ``(r, 4)``: mark row, centre mm, half width mm, blood fraction.
    solids ``(q, 6)``: mark row or -1, half thickness mm (0: solid), HU, label, level
    mm, Lipschitz constant; ground ``(q, 2)`` int32: span of each solid's field.
    plates ``(k, 2)`` int32: span of the zone of each thin plate.
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
    ground: Any
    plates: Any


class Grids(NamedTuple):
    """Bundle the outputs: arrays ``(nz, ny, nx)``, or ``(n,)`` of one block.

    air: least part value, clamped to the band, float32 mm; gap: least value of a part
    of another cavity, float32 mm; part: index of the least part, 255 where none is in
    the band; structure: row of the solid's mark at this place, 255 for none; blood:
    blood fraction, square root scale; skin: skin weight; ground_hu int16 and ground:
    HU and label of what lies behind mucosa and bone shell; plate: index of the thin
    plate that walls are here, 255 for none.
    """

    air: Any
    gap: Any
    part: Any
    structure: Any
    blood: Any
    skin: Any
    ground_hu: Any
    ground: Any
    plate: Any
