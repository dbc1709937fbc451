"""The page on which a scan is seen whole, and the way it is shown is edited."""
