"""Run the tests inside a real Blender, in a fresh user profile:

    export BLENDER_USER_RESOURCES=$(mktemp -d)
    blender -b --factory-startup --python-exit-code 1 --python tests/run_in_blender.py -- -q

Blender's Python needs pytest (Debian: ``python3-pytest``; else ``PYTHONPATH`` and
``--python-use-system-env``). Arguments after ``--`` go to pytest. Tests that need torch, trimesh or
scipy are skipped where these are missing.
"""

import os
import sys
from pathlib import Path

TESTS = Path(__file__).absolute().parent


def main() -> None:
    """Run pytest over this folder and end Blender with its status."""
    if "BLENDER_USER_RESOURCES" not in os.environ:
        sys.exit(
            "Set BLENDER_USER_RESOURCES to an empty folder, so that the tests keep away from your "
            "own profile."
        )
    import pytest

    arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    options = ["--import-mode=importlib", f"--rootdir={TESTS}", f"--confcutdir={TESTS}"]
    status = pytest.main([*options, *arguments, str(TESTS)])
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(int(status))


main()
