"""How a noise tile lies in memory."""

TILE_SIZE = 64
"""Voxels along an edge; a power of two, so that wrapping is a bit mask."""

ROW = TILE_SIZE + 1
SLICE = ROW * ROW
"""Voxels from one row and one slice of a stored tile to the next: it ends with its
beginning again, so that no corner of a cell needs wrapping."""
