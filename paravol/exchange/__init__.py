"""Tool motion for other programs, and from them: PerkTutor, 3D Slicer, PLUS, tables."""
