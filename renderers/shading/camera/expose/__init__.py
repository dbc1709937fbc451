"""Gain, lateral colour and what exceeds white."""
