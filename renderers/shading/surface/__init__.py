"""Direct light on what the G-buffer shows."""
