"""Which compiled functions trace rays on this machine."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from renderers.simd_guard import vector_problem

PACKET = 32
"""Rays that march together; of 4 to 64 the fastest with and without AVX-512."""


@dataclass(frozen=True, slots=True)
class KernelSet:
    """Hold what sets rays up and marches them. All sets give equal bits.

    march_unlit: `march_classic` for bricks without gradients. march_integrated:
    segments between samples; march_integrated_unlit: without gradients.
    """

    set_up_rays: Callable[..., None]
    march_classic: Callable[..., None]
    march_unlit: Callable[..., None]
    march_scope: Callable[..., None]
    march_integrated: Callable[..., None]
    march_integrated_unlit: Callable[..., None]


def _both(
    first: Callable[..., None], second: Callable[..., None], *args: object
) -> None:
    """Call one function after the other with the same arguments."""
    first(*args)
    second(*args)


def scalar_kernels() -> KernelSet:
    """Give the functions that every machine compiles: one ray after the other."""
    from renderers.art.integrated.kernels import march_integrated
    from renderers.art.kernels import march_classic, march_scope
    from renderers.art.preparation import set_up_rays

    return KernelSet(
        set_up_rays,
        march_classic,
        march_classic,
        march_scope,
        march_integrated,
        march_integrated,
    )


def packet_kernels(width: int) -> KernelSet:
    """Give functions for packets of `width` rays: 4, 8, 16, 32 or 64."""
    if width not in (4, 8, 16, 32, 64):
        raise ValueError(f"a packet has 4, 8, 16, 32 or 64 rays, got {width!r}")
    from renderers.art.integrated.packets.kernels import integrated_packets
    from renderers.art.vector.kernels import classic_packets
    from renderers.art.vector.rays.kernels import set_up_rays
    from renderers.art.vector.scope.kernels import seek_packets, settle_packets

    return KernelSet(
        set_up_rays,
        classic_packets(width, True),
        classic_packets(width, False),
        partial(_both, seek_packets(width), settle_packets(width)),
        integrated_packets(width, True),
        integrated_packets(width, False),
    )


def best_kernels() -> KernelSet:
    """Give packets where vectors can be trusted, else the scalar functions."""
    return scalar_kernels() if vector_problem() else packet_kernels(PACKET)
