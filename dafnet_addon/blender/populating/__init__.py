"""Fills a room with people: opened or built, read, planned, generated, baked, saved."""
