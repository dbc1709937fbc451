"""The kernel that evaluates the model over the bricks of a grid."""
