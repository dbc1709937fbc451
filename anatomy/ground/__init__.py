"""What lies behind mucosa and bone shells, painted in layers."""
