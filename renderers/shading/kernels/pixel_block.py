"""How a block of pixels lies in its scratch array.

A block is `ROWS` runs of `W` pixels, one below the other: neighbours in both
directions read the same voxels, which then are still in the nearest cache. Each
quantity has its own stretch of `N` floats at a constant offset. What lies beyond the
picture is kept finite but shown nowhere.
"""

W = 16
"""Pixels in a run: they are worked on together where each reads memory of its own."""
ROWS = 4
"""Runs in a block; divides CELL."""
N = ROWS * W
"""Pixels in a block. Where only arithmetic is done all are worked on together: several
chains of operations side by side hide each other's latency."""
CELL = 8
"""Pixels between points of the bounce grid; divides W."""

# unit ray, depth, coverage; normal; point from the eye in mm, and in voxels
DX, DY, DZ, T, COVER = 0, N, 2 * N, 3 * N, 4 * N
NX, NY, NZ = 5 * N, 6 * N, 7 * N
PX, PY, PZ, UX, UY, UZ = 8 * N, 9 * N, 10 * N, 11 * N, 12 * N, 13 * N
# mm a pixel covers, skin weight, Fresnel reflectance, GGX width squared
FOOT, SKIN, F0, A2 = 14 * N, 15 * N, 16 * N, 17 * N
# albedo; diffusion lengths of red and green light in mm
RED, GREEN, BLUE, LR, LG = 18 * N, 19 * N, 20 * N, 21 * N, 22 * N
# normals of the tissue and of the film on it
TX, TY, TZ, HX, HY, HZ = 23 * N, 24 * N, 25 * N, 26 * N, 27 * N, 28 * N
# sums over light sources; bounce light, weighed
E_RED, E_GREEN, SPARK, BOUNCE = 29 * N, 30 * N, 31 * N, 32 * N
# blood code; the material's share of tissue, relief, GGX width squared and additions
CODE, SHARE, RELIEF, ROUGH = 33 * N, 34 * N, 35 * N, 36 * N
ADD_RED, ADD_GREEN, ADD_BLUE, ADD_LR, ADD_LG = 37 * N, 38 * N, 39 * N, 40 * N, 41 * N
# three noise octaves and the two sizes of vessel: value and gradient per mm, and
# before the tap the cell's number (its bits) and where the point is in it
LONG, MIDDLE, SHORT, LARGE, SMALL = 42 * N, 46 * N, 50 * N, 54 * N, 58 * N
# one light source: unit direction to it, intensity, widening of the film's lobe
LX, LY, LZ, POWER, SPREAD = 62 * N, 63 * N, 64 * N, 65 * N, 66 * N
# point in mm and in voxels, as above, of where tissue is shown that was pushed there
SHOWN = 67 * N
SHOWN_UX = SHOWN + 3 * N
SLOTS = 73 * N
