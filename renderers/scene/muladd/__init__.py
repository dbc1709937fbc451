"""A product added to a number, for compiled code."""
