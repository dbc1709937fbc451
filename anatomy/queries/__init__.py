"""Questions to a head: hazards, landmarks, scores, tissue at a place."""
