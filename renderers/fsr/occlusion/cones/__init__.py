"""Cones around squares of pixels, and where walls end them."""
