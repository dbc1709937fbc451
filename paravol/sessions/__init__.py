"""Recorded sessions: kept, opened, stepped, looked through and drawn again."""
