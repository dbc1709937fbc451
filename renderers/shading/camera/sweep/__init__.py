"""All that follows exposure, in one sweep over the rows."""
