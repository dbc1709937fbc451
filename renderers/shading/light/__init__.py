"""Light of the scope's own sources on a block of pixels."""
