"""Devices that push back: a port for them, an emulated head, a guard before all."""
