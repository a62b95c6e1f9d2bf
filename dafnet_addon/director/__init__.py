"""From what a character is to do in a scene to its root path: places to sit found on meshes, ways
round furniture.
"""
