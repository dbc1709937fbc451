"""The same views by every mode, every light and every peer, for `docs/gallery.md`."""
