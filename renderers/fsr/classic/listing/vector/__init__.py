"""Strips listed with vectors."""
