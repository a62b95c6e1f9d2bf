"""A character that follows while its root and targets are dragged, and what is kept of it."""
