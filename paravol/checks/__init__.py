"""What is found out about this machine, its devices and an arm."""
