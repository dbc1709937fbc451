"""Compiled code of the arm: from counts to a frame."""
