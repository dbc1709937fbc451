"""What rays of mode `scope` found, taken apart into the planes of a G-buffer."""
