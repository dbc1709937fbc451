"""Gaussian blurs of rows of colour planes."""
