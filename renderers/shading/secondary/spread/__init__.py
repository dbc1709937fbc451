"""What was found at lattice points, brought to all pixels."""
