"""Run time against error, measured beside peers in the same run."""
