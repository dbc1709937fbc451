"""Frames drawn by real ranks, and what the simulator foretells of them."""
