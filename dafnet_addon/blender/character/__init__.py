"""The character: its bones and body, what the animator has set on it, and its takes."""
