"""Ways in which an arm or its line goes wrong, by name."""
