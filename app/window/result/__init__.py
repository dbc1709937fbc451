"""The page after a flight: what it was worth, why, and what comes next."""
