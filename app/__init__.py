"""Windows and commands: the only place that joins everything. Has no names."""
