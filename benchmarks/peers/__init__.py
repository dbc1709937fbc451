"""VTK's renderers in processes of their own, measured on our scenes."""
