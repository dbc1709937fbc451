"""First samples of rays, computed on vectors."""
