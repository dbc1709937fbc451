"""The page of the window on which one flies."""
