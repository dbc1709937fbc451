"""The volume in cells, and the bricks that rays read."""
