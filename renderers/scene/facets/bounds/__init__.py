"""Where in a picture a triangle can be."""
