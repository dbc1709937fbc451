"""Both stages of a strip, culling and drawing, in one call."""
