"""Tiles of a picture of mode `classic`, before and after splats are blended."""
