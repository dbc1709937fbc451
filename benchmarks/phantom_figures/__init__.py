"""The figures of `docs/anatomy.md`, measured on a phantom."""
