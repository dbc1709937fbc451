"""What a trainee comes back to: exercises and results, cases, devices, choices."""
