"""What a triangle looks like where it is seen."""
