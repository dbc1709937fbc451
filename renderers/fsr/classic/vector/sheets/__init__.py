"""Splats of mode `classic` summed in sheets of depth."""
