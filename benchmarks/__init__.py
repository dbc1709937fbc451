"""Run time against error, peers measured in the same run on the same scene."""
