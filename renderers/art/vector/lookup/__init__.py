"""Transfer functions, looked up by packets of samples."""
