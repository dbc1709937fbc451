"""What lies between two samples, one ray at a time."""
