"""Keys: what each does, where it lies, and what the user's keyboard prints on it."""
