"""The squares of a tile that surfels meet."""
