"""PARAVOL without a screen: patients, flights, replays, snapshots."""
