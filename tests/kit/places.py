"""Where things are: the repository, and the data that may lie beside it."""

from pathlib import Path

__all__ = ["EXTENSION", "FURNITURE", "LIBRARY", "MOCAP", "RAW", "ROOT", "SHARED"]

ROOT = Path(__file__).absolute().parents[2]
EXTENSION = "bl_ext.user_default.dafnet"
"""The package as which Blender loads the repository."""

SHARED = ROOT.parent / "shared" / "data"
MOCAP = SHARED / "mocap"
RAW = MOCAP / "raw_samples"
FURNITURE = SHARED / "furniture"
LIBRARY = FURNITURE / "library"
