"""Compiled: the fields, distances and tissues of the phantom."""
