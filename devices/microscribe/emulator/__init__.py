"""An emulated arm, to the byte."""
