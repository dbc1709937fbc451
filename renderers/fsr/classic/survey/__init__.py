"""A set's rows clipped against a view, and how far away they are."""
