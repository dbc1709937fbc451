"""The page at which the window opens: what to train next, and how one stands."""
