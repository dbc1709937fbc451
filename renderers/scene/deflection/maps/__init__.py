"""The maps of `renderers.scene.deflection`, compiled."""
