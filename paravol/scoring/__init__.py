"""What a session was worth: its metrics, its score, and their words."""
