"""How a block of pixels lies in its scratch array.

Each quantity has its own stretch of `N` floats at a constant offset, so that a
compiler sees that no two overlap and turns plain loops over a block into vector code.
"""

N = 64
"""Pixels in a block."""
CELL = 8
"""Pixels between points of the bounce grid; divides N."""

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
# sums over light sources; bounce light and the weight it came with
E_RED, E_GREEN, SPARK, BOUNCE, WEIGHT = 29 * N, 30 * N, 31 * N, 32 * N, 33 * N
# blood code; what the material adds to the tissue's share
CODE, SHARE, RELIEF = 34 * N, 35 * N, 36 * N
ADD_RED, ADD_GREEN, ADD_BLUE, ADD_LR, ADD_LG = 37 * N, 38 * N, 39 * N, 40 * N, 41 * N
# three noise octaves: value and gradient per mm
LONG, MIDDLE, SHORT = 42 * N, 46 * N, 50 * N
# a corner of the bounce grid, spread over its cells
C_E, C_X, C_Y, C_Z, C_T = 54 * N, 55 * N, 56 * N, 57 * N, 58 * N
SLOTS = 59 * N
