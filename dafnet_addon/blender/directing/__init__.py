"""Keys on a character's root: walks to seats, paths from curves, points and moving objects."""
