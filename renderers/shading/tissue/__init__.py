"""What the surface is made of at each pixel."""
