"""Light by way of one more surface: mirrored by metal and film, or through a wall."""
