"""The scene as plain arrays: what is in it, what it follows, how it plays."""
