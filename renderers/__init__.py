"""Two renderers, what they share and the reference they are judged by."""
