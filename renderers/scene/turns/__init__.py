"""Turns that threads inside compiled code take without asking Python."""
