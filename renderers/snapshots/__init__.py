"""The snapshot service: requests in a folder, workers, pictures."""
