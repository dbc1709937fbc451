"""Tone curve and sRGB code of packets of pixels."""
