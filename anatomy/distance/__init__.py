"""From the sign of the air function to a true signed distance."""
