"""Pictures of a head that are no endoscope's: slices, a cutaway, what was seen."""
