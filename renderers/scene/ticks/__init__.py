"""A clock that compiled code can read."""
