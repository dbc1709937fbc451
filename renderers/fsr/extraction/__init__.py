"""Compiled sweeps over a volume that pick the voxels worth drawing."""
