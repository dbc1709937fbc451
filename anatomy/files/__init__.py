"""Files of volumes, surfaces and landmarks, and the cache of phantoms."""
