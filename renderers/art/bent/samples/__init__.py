"""Classification, light and gaps, sample by sample."""
