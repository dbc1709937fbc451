"""A live arm: its thread, its poses, its plug."""
