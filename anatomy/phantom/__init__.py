"""The synthetic sinus phantom: its shapes, and the volumes made from them."""
