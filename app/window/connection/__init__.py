"""The page on which an arm is looked at and registered."""
