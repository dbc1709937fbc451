"""Light on packets of samples."""
