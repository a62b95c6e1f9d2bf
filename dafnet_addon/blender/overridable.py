"""What a library override of a character or a rig keeps in its own file: Blender grants it
property by property, and forgets the others when the file is opened again.
"""

__all__ = ["LOCALLY", "ROWS_LOCALLY"]

LOCALLY = {"LIBRARY_OVERRIDABLE"}
"""The value of a property."""
ROWS_LOCALLY = {*LOCALLY, "USE_INSERTION"}
"""The rows that are added to a collection."""
