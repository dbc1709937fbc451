"""Compiled code of the anatomy: fields, distances, tissues."""
