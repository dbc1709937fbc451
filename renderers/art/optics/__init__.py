"""Functions of light that scalar and vector marches share bit for bit."""
