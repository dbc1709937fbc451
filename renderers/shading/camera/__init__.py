"""From radiance to the picture on the monitor."""
