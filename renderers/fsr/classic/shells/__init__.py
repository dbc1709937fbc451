"""Elements of a set between two distances from the eye."""
