"""How much light a picture has."""
