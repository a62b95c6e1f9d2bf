"""Example scenes, the demo's room, and pictures of them."""
