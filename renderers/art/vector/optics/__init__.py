"""The functions of `renderers.art.optics` on vectors."""
