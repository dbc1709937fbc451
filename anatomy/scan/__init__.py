"""A patient's own scan: read, understood, made into a case."""
