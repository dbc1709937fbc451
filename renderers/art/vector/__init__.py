"""The marches of `renderers.art.kernels` on vectors: packets of rays."""
