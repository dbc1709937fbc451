"""Which compiled functions trace rays on this machine."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

from renderers.simd_guard import vector_problem

PACKET = 32
"""Rays that march together; of 4 to 64 the fastest with and without AVX-512."""


StripKernel = Callable[..., tuple[int, int, int]]
"""Draws a strip of a picture at once; see `renderers.art.strips`."""


@dataclass(frozen=True, slots=True)
class KernelSet:
    """Hold what sets rays up and marches them. All sets give equal bits.

    march_unlit: `march_classic` for bricks without gradients. march_integrated:
    segments between samples; march_integrated_unlit: without gradients. draw_lit,
    draw_unlit, draw_scope and the integrated ones: the same for strips at once; None
    where rays go by packets only.
    """

    set_up_rays: Callable[..., None]
    march_classic: Callable[..., None]
    march_unlit: Callable[..., None]
    march_scope: Callable[..., None]
    march_integrated: Callable[..., None]
    march_integrated_unlit: Callable[..., None]
    draw_lit: StripKernel | None = None
    draw_unlit: StripKernel | None = None
    draw_scope: StripKernel | None = None
    draw_integrated: StripKernel | None = None
    draw_integrated_unlit: StripKernel | None = None


def _both(
    first: Callable[..., None], second: Callable[..., None], *args: object
) -> None:
    """Call one function after the other with the same arguments."""
    first(*args)
    second(*args)


def scalar_kernels() -> KernelSet:
    """Give the functions that every machine compiles: one ray after the other."""
    from renderers.art.kernels.build_bricks import set_up_rays
    from renderers.art.kernels.march_integrated_scalar import march_integrated
    from renderers.art.kernels.march_scalar import march_classic, march_scope

    return KernelSet(
        set_up_rays,
        march_classic,
        march_classic,
        march_scope,
        march_integrated,
        march_integrated,
    )


def packet_kernels(width: int) -> KernelSet:
    """Give functions for packets of `width` rays: 4, 8, 16, 32 or 64.

    Strips are drawn at once in packets of 32 only.
    """
    if width not in (4, 8, 16, 32, 64):
        raise ValueError(f"a packet has 4, 8, 16, 32 or 64 rays, got {width!r}")
    from renderers.art.kernels.find_surface import seek_packets, settle_packets
    from renderers.art.kernels.march_integrated import integrated_packets
    from renderers.art.kernels.march_packets import classic_packets
    from renderers.art.kernels.set_up_rays import set_up_rays

    packets = KernelSet(
        set_up_rays,
        classic_packets(width, True),
        classic_packets(width, False),
        partial(_both, seek_packets(width), settle_packets(width)),
        integrated_packets(width, True),
        integrated_packets(width, False),
    )
    return _with_strips(packets) if width == PACKET else packets


def _with_strips(packets: KernelSet) -> KernelSet:
    from renderers.art.kernels.draw_blocks import (
        draw_integrated,
        draw_integrated_unlit,
        draw_lit,
        draw_scope,
        draw_unlit,
    )

    return replace(
        packets,
        draw_lit=draw_lit,
        draw_unlit=draw_unlit,
        draw_scope=draw_scope,
        draw_integrated=draw_integrated,
        draw_integrated_unlit=draw_integrated_unlit,
    )


def best_kernels() -> KernelSet:
    """Give packets where vectors can be trusted, else the scalar functions."""
    return scalar_kernels() if vector_problem() else packet_kernels(PACKET)
