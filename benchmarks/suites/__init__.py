"""The suites of `paravol bench`: each lists and makes its measurements."""
