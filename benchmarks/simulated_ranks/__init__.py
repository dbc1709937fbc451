"""The rank protocol on a simulated machine: discrete events on a torus of ranks."""
