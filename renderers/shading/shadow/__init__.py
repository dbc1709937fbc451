"""What a tool takes of the light: shadows of the fibres, darkness where it touches."""
