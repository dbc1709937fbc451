"""Hands without an arm: pedals, keys, mouse, gamepad, and the scope they steer."""
