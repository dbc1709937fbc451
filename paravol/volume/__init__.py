"""A scan shown whole, from outside or inside, as a volume or as a surface."""
