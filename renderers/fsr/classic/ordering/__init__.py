"""The order of projected splats, and the tiles that they touch."""
