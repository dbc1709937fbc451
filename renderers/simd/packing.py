"""Chosen lanes stored side by side."""

from typing import Any

from numba import types
from numba.core.typing.templates import signature
from numba.extending import intrinsic

from renderers.simd.load_store import bytes_of, is_plain
from renderers.simd.vector import (
    BYTE,
    ELEMENTS,
    I32,
    I64,
    Vector,
    call_llvm,
    data,
    ir,
    mangled,
    splat,
)


def _by_table(context: Any, kind: Any) -> bool:
    """Return whether lanes are best packed by a table: eights of 4 bytes, on AVX2.

    Where the processor cannot pack them, LLVM takes them one by one: 1.7 ns a lane
    where the table takes .6 (code for AVX2 on Zen 4).
    """
    _, _, features = context.codegen().magic_tuple()
    can = "+avx2" in features and "+avx512vl" not in features
    return can and kind.count in (8, 16, 32) and bytes_of(kind.element) == 4


def _table(builder: Any) -> Any:
    """Return 256 rows: which lanes of eight a mask sets, first ones first."""
    name = "paravol.set_lanes"
    found = builder.module.globals.get(name)
    if found is None:
        lanes = [[k for k in range(8) if mask >> k & 1] for mask in range(256)]
        rows = bytes(k for row in lanes for k in (row + [0] * 8)[:8])
        value = ir.Constant(ir.ArrayType(BYTE, len(rows)), bytearray(rows))
        found = ir.GlobalVariable(builder.module, value.type, name)
        found.linkage, found.global_constant, found.initializer = (
            "internal",
            True,
            value,
        )
    return builder.bitcast(found, ir.PointerType())


def _store_by_table(builder: Any, x: Any, at: Any, mask: Any) -> None:
    """Pack eight lanes at a time and store them behind one another."""
    element, count = x.type.element, x.type.count
    eight, row = ir.VectorType(element, 8), ir.VectorType(BYTE, 8)
    places = ir.VectorType(I32, 8)
    name = "permps" if element == ELEMENTS["f32"] else "permd"
    word = ir.IntType(count)
    bits = builder.bitcast(mask, word)
    steps = ir.Constant(places, list(range(8)))
    table = _table(builder)
    for first in range(0, count, 8):
        some = builder.trunc(builder.lshr(bits, word(first)), ir.IntType(8))
        at_row = builder.gep(table, [builder.zext(some, I64)], source_etype=row)
        lanes = builder.load(builder.bitcast(at_row, row.as_pointer()))
        lanes.align = 8
        lanes = builder.zext(lanes, places)
        chosen = ir.Constant(places, list(range(first, first + 8)))
        half = builder.shuffle_vector(x, ir.Constant(x.type, ir.Undefined), chosen)
        packed = call_llvm(builder, f"llvm.x86.avx2.{name}", eight, [half, lanes])
        found = call_llvm(builder, "llvm.ctpop.i8", ir.IntType(8), [some])
        limit = splat(builder, builder.zext(found, I32), 8)
        met = builder.icmp_unsigned("<", steps, limit)
        call_llvm(
            builder,
            f"llvm.masked.store.{mangled(eight)}.p0",
            ir.VoidType(),
            [packed, at, I32(4), met],
        )
        at = builder.gep(at, [builder.zext(found, I64)], source_etype=element)
        at = builder.bitcast(at, ir.PointerType())


def _store_packed(typingctx: Any, array: Any, index: Any, x: Any, mask: Any) -> Any:
    """Store the lanes whose mask is set side by side, from the index-th element on.

    Elements of 4 or 8 bytes; ``count(mask)`` are written.
    """
    if not isinstance(x, Vector) or mask != x.like("bool"):
        return None
    if not is_plain(array, x.element):
        return None

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        base = data(context, builder, sig.args[0], args[0])
        kind = x.llvm
        at = builder.gep(base, [args[1]], source_etype=kind.element)
        at = builder.bitcast(at, ir.PointerType())
        if kind.count * bytes_of(kind.element) > 64:
            # more than LLVM 22 can pack at once without a fault
            name = f"llvm.masked.compressstore.{mangled(kind)}"
            call_llvm(builder, name, ir.VoidType(), [args[2], at, args[3]])
            return context.get_dummy_value()
        if _by_table(context, kind):
            _store_by_table(builder, args[2], at, args[3])
            return context.get_dummy_value()
        # Packed in a register, then stored: Zen 4 takes sixty cycles to do both at
        # once (1.3 ns instead of 0.12 for each of sixteen lanes).
        name = f"llvm.experimental.vector.compress.{mangled(kind)}"
        rest = ir.Constant(kind, ir.Undefined)
        packed = call_llvm(builder, name, kind, [args[2], args[3], rest])
        mask_bits = ir.IntType(kind.count)
        bits = builder.bitcast(args[3], mask_bits)
        found = call_llvm(builder, f"llvm.ctpop.i{kind.count}", mask_bits, [bits])
        # as many lowest bits as lanes were found; all of them shift out to nothing
        wide = ir.IntType(2 * kind.count)
        ones = builder.shl(ir.Constant(wide, 1), builder.zext(found, wide))
        ones = builder.trunc(builder.sub(ones, ir.Constant(wide, 1)), mask_bits)
        first = builder.bitcast(ones, args[3].type)
        align = ir.Constant(I32, bytes_of(kind.element))
        name = f"llvm.masked.store.{mangled(kind)}.p0"
        call_llvm(builder, name, ir.VoidType(), [packed, at, align, first])
        return context.get_dummy_value()

    return signature(types.void, array, types.intp, x, mask), generate


# which instructions there are is known to the context alone
store_packed: Any = intrinsic(_store_packed)
