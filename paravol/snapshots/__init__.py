"""High-quality pictures: views, requests, outputs."""
