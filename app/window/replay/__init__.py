"""The page that replays recorded sessions."""
