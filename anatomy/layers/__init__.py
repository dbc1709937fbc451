"""The kernel that paints tissues by their share of each voxel."""
