"""The trainee's window."""
