"""The distance field at many places at once."""
