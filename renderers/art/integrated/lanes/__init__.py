"""What lies between two samples, lane by lane."""
