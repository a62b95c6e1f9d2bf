"""Takes that hover over seats or sink into them come to rest where those carry a body, as the
benchmark measures it.
"""

import runpy

import numpy as np
import pytest

from dafnet_addon.core.generate import Draw
from kit.places import LIBRARY, ROOT

REST = runpy.run_path(str(ROOT / "benchmarks" / "rest.py"))
