"""Trilinear interpolation, one cell per lane: four interleaved channels, or one."""

from typing import Any

from numba import types
from numba.core.typing.templates import signature

from renderers.simd.load_store import stored
from renderers.simd.records import byte_offsets, load_part, spread_in_groups, transpose
from renderers.simd.vector import (
    BYTE,
    ELEMENTS,
    I32,
    I64,
    Vector,
    concatenate,
    ir,
    shuffle,
    splat,
    vector_function,
)

_I16 = ir.IntType(16)
_PAIR = ir.VectorType(_I16, 8)
_TWO_REALS = ir.VectorType(ELEMENTS["f32"], 2)
_REALS = ir.VectorType(ELEMENTS["f32"], 4)
_SCALE = 32767


def _add_products(builder: Any, x: Any, y: Any) -> Any:
    """Sum products of neighbouring i16 lanes, as x86 compilers know `pmaddwd`."""
    n = x.type.count
    wide = ir.VectorType(I32, n)
    product = builder.mul(builder.sext(x, wide), builder.sext(y, wide))
    even = shuffle(builder, product, product, range(0, n, 2))
    return builder.add(even, shuffle(builder, product, product, range(1, n, 2)))


def _interleaved(n: int, corner: int) -> list[int]:
    """Lanes that pair one x corner of rows y and y + 1, channel by channel."""
    return [
        lane
        for i in range(0, 2 * n, 8)
        for channel in range(4)
        for lane in (i + 4 * corner + channel, 2 * n + i + 4 * corner + channel)
    ]


def _lerp(builder: Any, x: Any, y: Any, f: Any) -> Any:
    return builder.fadd(x, builder.fmul(f, builder.fsub(y, x)))


def _y_weights(builder: Any, fy: Any, n: int) -> Any:
    """Return (32767 - w, w) in the halves of i32 lanes, w the rounded y fraction."""
    scale = splat(builder, ir.Constant(ELEMENTS["f32"], float(_SCALE)), n)
    half = splat(builder, ir.Constant(ELEMENTS["f32"], 0.5), n)
    rounded = builder.fadd(builder.fmul(fy, scale), half)
    above = builder.fptosi(rounded, ir.VectorType(I32, n))
    below = builder.sub(splat(builder, ir.Constant(I32, _SCALE), n), above)
    high = builder.shl(above, splat(builder, ir.Constant(I32, 16), n))
    return builder.or_(below, high)


def _starts(builder: Any, base: Any, y_step: Any, z_step: Any, shift: int) -> list[Any]:
    """Return where the four lines of a cell along x begin, for its first voxel at 0."""
    by = ir.Constant(I64, shift)
    along, deep = builder.shl(y_step, by), builder.shl(z_step, by)
    both = builder.add(along, deep)
    return [base] + [
        builder.gep(base, [o], source_etype=BYTE) for o in (along, deep, both)
    ]


def _whole_numbers(builder: Any, base: Any, *args: Any) -> list[Any]:
    """Blend int16 channels: y in integers, then z and x; times 32767."""
    voxel, y_step, z_step, fx, fy, fz = args
    n = voxel.type.count
    rows = _starts(builder, base, y_step, z_step, 3)
    offsets = byte_offsets(builder, voxel, 3)
    weights = _y_weights(builder, fy, n)
    parts = []
    for part in range(4):
        pair = builder.bitcast(
            spread_in_groups(builder, weights, part), ir.VectorType(_I16, 2 * n)
        )
        px = spread_in_groups(builder, fx, part)
        pz = spread_in_groups(builder, fz, part)
        cells = [load_part(builder, r, offsets, _PAIR, part, 2) for r in rows]
        corners = []
        for corner in (0, 1):
            order = _interleaved(n, corner)
            front, back = (
                builder.sitofp(
                    _add_products(
                        builder, shuffle(builder, cells[z], cells[z + 1], order), pair
                    ),
                    fx.type,
                )
                for z in (0, 2)
            )
            corners.append(_lerp(builder, front, back, pz))
        parts.append(_lerp(builder, corners[0], corners[1], px))
    return parts


def _reals(builder: Any, base: Any, *args: Any) -> list[Any]:
    """Blend float32 channels along x, then y, then z."""
    voxel, y_step, z_step, fx, fy, fz = args
    starts = _starts(builder, base, y_step, z_step, 4)
    next_voxel = ir.Constant(I64, 16)
    offsets = byte_offsets(builder, voxel, 4)
    parts = []
    for part in range(4):
        px, py, pz = (spread_in_groups(builder, f, part) for f in (fx, fy, fz))
        lines = []
        for start in starts:
            after = builder.gep(start, [next_voxel], source_etype=BYTE)
            left, right = (
                load_part(builder, end, offsets, _REALS, part, 4)
                for end in (start, after)
            )
            lines.append(_lerp(builder, left, right, px))
        front = _lerp(builder, lines[0], lines[1], py)
        back = _lerp(builder, lines[2], lines[3], py)
        parts.append(_lerp(builder, front, back, pz))
    return parts


def _cell_type(samples: Any, voxel: Any, *fractions: Any) -> Any:
    """Return the type of what is interpolated, or None where arguments do not fit."""
    if stored(samples) is None or samples.dtype not in (types.int16, types.float32):
        return None
    if not isinstance(voxel, Vector) or voxel.element != "i32" or voxel.count < 4:
        return None
    result = voxel.like("f32")
    return None if any(f != result for f in fractions) else result


@vector_function
def cell4(
    quads: Any, voxel: Any, y_step: Any, z_step: Any, fx: Any, fy: Any,
    fz: Any,
) -> Any:  # fmt: skip
    """Interpolate four channels between the eight corners of a cell.

    quads: four channels a voxel, int16 or float32. voxel: i32 lanes, the lowest
    corner's number. y_step, z_step: voxels to the next along y and z. fx, fy, fz: f32
    fractions in 0..1.

    float32: along x, then y, then z, each as ``a + f (b - a)``. int16: the result is
    32767 times as large; two x corners with all channels are one 16-byte load; the
    blend along y is exact in integers, with fy rounded to 1 / 32767; then z and x in
    float32.
    """
    result = _cell_type(quads, voxel, fx, fy, fz)
    if result is None:
        return None
    blend = _whole_numbers if quads.dtype == types.int16 else _reals

    def emit(builder: Any, base: Any, *args: Any) -> Any:
        return transpose(builder, blend(builder, base, *args))

    steps = (types.int64, types.int64)
    sig = signature(types.UniTuple(result, 4), quads, voxel, *steps, fx, fy, fz)
    return sig, emit


def _join_lines(
    builder: Any, starts: list[Any], offsets: list[Any], kind: Any, part: int
) -> Any:
    """Load a piece of each line of a cell, side by side, for one part of four."""
    size = kind.count if isinstance(kind, ir.VectorType) else 1
    joined = []
    for k in range(part, len(offsets), 4):
        pieces = []
        for start in starts:
            at = builder.gep(start, [offsets[k]], source_etype=BYTE)
            x = builder.load(builder.bitcast(at, kind.as_pointer()))
            x.align = 2 if size == 1 else 4
            pieces.append(x)
        if size == 1:
            lane: Any = ir.Constant(ir.VectorType(kind, len(pieces)), ir.Undefined)
            for i, piece in enumerate(pieces):
                lane = builder.insert_element(lane, piece, ir.Constant(I32, i))
            joined.append(lane)
        else:
            joined.append(concatenate(builder, pieces))
    return concatenate(builder, joined)


def _one_whole_number(builder: Any, base: Any, *args: Any) -> Any:
    """Blend one int16 channel as `_whole_numbers` does each of four."""
    voxel, y_step, z_step, fx, fy, fz = args
    n = voxel.type.count
    starts = _starts(builder, base, y_step, z_step, 1)
    offsets = byte_offsets(builder, voxel, 1)
    weights = _y_weights(builder, fy, n)
    # Both x corners of four lines, turned into both lines of an x corner.
    order = [i + k for i in range(0, 2 * n, 4) for k in (0, 2, 1, 3)]
    parts = []
    for part in range(4):
        pair = builder.bitcast(
            spread_in_groups(builder, weights, part), ir.VectorType(_I16, 2 * n)
        )
        lines = _join_lines(builder, starts, offsets, I32, part)
        lines = builder.bitcast(lines, ir.VectorType(_I16, 2 * n))
        lines = shuffle(builder, lines, lines, order)
        parts.append(builder.sitofp(_add_products(builder, lines, pair), fx.type))
    front_left, front_right, back_left, back_right = transpose(builder, parts)
    left = _lerp(builder, front_left, back_left, fz)
    right = _lerp(builder, front_right, back_right, fz)
    return _lerp(builder, left, right, fx)


def _one_real(builder: Any, base: Any, *args: Any) -> Any:
    """Blend one float32 channel along x, then y, then z."""
    voxel, y_step, z_step, fx, fy, fz = args
    starts = _starts(builder, base, y_step, z_step, 2)
    offsets = byte_offsets(builder, voxel, 2)
    faces = []
    for face in (starts[:2], starts[2:]):
        a, b, c, d = transpose(
            builder,
            [_join_lines(builder, face, offsets, _TWO_REALS, p) for p in range(4)],
        )
        line, next_line = _lerp(builder, a, b, fx), _lerp(builder, c, d, fx)
        faces.append(_lerp(builder, line, next_line, fy))
    return _lerp(builder, faces[0], faces[1], fz)


@vector_function
def cell1(
    values: Any, voxel: Any, y_step: Any, z_step: Any, fx: Any, fy: Any,
    fz: Any,
) -> Any:  # fmt: skip
    """Interpolate one channel: the first that `cell4` gives, to the bit.

    values: a number a voxel, int16 or float32. The rest is as `cell4` has it. Half of
    its instructions and a quarter of its memory.
    """
    found = _cell_type(values, voxel, fx, fy, fz)
    if found is None:
        return None
    blend = _one_whole_number if values.dtype == types.int16 else _one_real

    steps = (types.int64, types.int64)
    return signature(found, values, voxel, *steps, fx, fy, fz), blend
