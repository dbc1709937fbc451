"""Light around what exceeds white."""
