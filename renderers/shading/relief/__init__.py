"""How bumps and ripples bend the normals."""
