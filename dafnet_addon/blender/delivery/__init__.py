"""What is handed on of a shot besides the scene: ground truth, rendered frames, masks and depth,
and files for other programs.

All of it is read from what Blender plays, edits included, and nothing of the user's is changed:
what the scene shows, plays and has selected afterwards is what it did before.
"""
