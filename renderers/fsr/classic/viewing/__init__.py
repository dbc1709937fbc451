"""A camera in terms of a grid."""
