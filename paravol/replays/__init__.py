"""A recorded session looked through by a person: moments, marks, another camera."""
