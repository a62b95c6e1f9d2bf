"""Rigs of the animator's own: which bone is which joint, and baking onto them."""
