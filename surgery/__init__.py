"""Surgery: how tissue comes away, exactly and the same in every replay.

A floor below the scenarios: it knows volumes and walls, and no renderer, no device, no
clock.
"""
