"""What ground metal mirrors, run together."""
