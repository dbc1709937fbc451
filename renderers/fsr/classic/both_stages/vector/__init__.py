"""Both stages of a strip with vectors."""
