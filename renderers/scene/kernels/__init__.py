"""Compiled code of the vocabulary: triangles and deflected rays."""
