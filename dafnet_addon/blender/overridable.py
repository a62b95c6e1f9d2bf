"""What a library override of a character or a rig keeps in its own file: Blender grants it
property by property, and forgets the others when the file is opened again.
"""

from itertools import count
from typing import Any

__all__ = ["LOCALLY", "ROWS_LOCALLY", "add_named"]

LOCALLY = {"LIBRARY_OVERRIDABLE"}
"""The value of a property."""
ROWS_LOCALLY = {*LOCALLY, "USE_INSERTION"}
"""The rows that are added to a collection."""


def add_named(rows: Any) -> Any:
    """A new row of a collection, with a name of its own: of rows without, an override loses some
    when its file is opened again.
    """
    name = next(name for k in count(1) if (name := str(k)) not in rows)
    row = rows.add()
    row.name = name
    return row
