"""How a block of pixels lies in its scratch array.

Each quantity has its own stretch of `N` floats at a constant offset, so that a
compiler sees that no two overlap and turns plain loops over a block into vector code.
"""

N = 64
CELL = 8
"""Pixels between points of the bounce grid; divides N."""

# offsets of a block's quantities
DX, DY, DZ, T, COVER = 0, N, 2 * N, 3 * N, 4 * N
NX, NY, NZ = 5 * N, 6 * N, 7 * N
PX, PY, PZ, UX, UY, UZ = 8 * N, 9 * N, 10 * N, 11 * N, 12 * N, 13 * N
FOOT, SKIN, F0, A2 = 14 * N, 15 * N, 16 * N, 17 * N
RED, GREEN, BLUE, LR, LG = 18 * N, 19 * N, 20 * N, 21 * N, 22 * N
TX, TY, TZ, HX, HY, HZ = 23 * N, 24 * N, 25 * N, 26 * N, 27 * N, 28 * N
E_RED, E_GREEN, SPARK, BOUNCE, WEIGHT = 29 * N, 30 * N, 31 * N, 32 * N, 33 * N
SLOTS = 34 * N
