"""Where packets of rays stand, and how far they leap over what is empty."""
