"""The search for the air surface on vectors."""
