"""Motion that nobody recorded in one go, composed of captured pieces."""
