"""Furniture, made of boxes or real, and how it is fitted to motion."""
