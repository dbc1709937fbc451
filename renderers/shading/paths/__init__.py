"""Light between walls by random paths: slow, and right up to a noise that is told."""
