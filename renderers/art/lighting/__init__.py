"""What lights make of a sample."""
