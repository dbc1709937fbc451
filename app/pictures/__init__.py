"""Pictures at rest: what is looked at, how it is drawn, what is written."""
