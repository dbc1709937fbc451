"""Ways of many rays to the walls that they meet."""
