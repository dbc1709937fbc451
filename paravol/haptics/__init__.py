"""Force feedback: the loop of 1 kHz between a force device and the tissue."""
