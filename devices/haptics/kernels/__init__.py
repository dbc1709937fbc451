"""Compiled: the emulated head, the guard before a device, calls into a device's SDK."""
