"""Light that reaches a pixel after one bounce off another wall."""
