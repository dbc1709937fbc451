"""The line to an arm: bytes, packets, commands, sign-on."""
