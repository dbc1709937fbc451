"""Splats of mode `classic` projected: scalar kernels, and vectors of sixteen."""
