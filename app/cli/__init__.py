"""The commands of `paravol`."""
