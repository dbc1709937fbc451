"""An arm's joints, constants and errors."""
