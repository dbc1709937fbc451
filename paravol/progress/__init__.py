"""Progress over time: sessions kept in one file, learning curves, cohorts, exports."""
