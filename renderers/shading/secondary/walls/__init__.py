"""What thin walls do with light."""
