"""Values and gradients between voxels."""
