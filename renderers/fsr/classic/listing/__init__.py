"""All that culling finds for a strip, in one call."""
