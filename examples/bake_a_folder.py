"""Bake a folder of scenes without a window, one process each, three takes a scene.

    .venv/bin/python examples/bake_a_folder.py SHOTS BAKED

Scenes that cannot be baked are named with the reason, and stop no other; what is baked already is
left alone, so that the same command goes on where it was stopped.
"""

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).absolute().parents[1]
TAKES = 3


def bake(scene: Path, out: Path) -> str:
    """One scene; what is to be said of it."""
    command = [sys.executable, "-m", "dafnet_addon", "bake", str(scene.absolute()), "--json"]
    command += ["-o", str(out.absolute()), "--takes", str(TAKES), "--temperature", "0.5"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, encoding="utf-8")
    if done.returncode:
        return done.stderr.strip().splitlines()[-1]

    # Blender may say something of its own before the report, which is the last thing to be said.
    report = json.loads(done.stdout[done.stdout.index("{") :])
    return f"{len(report['takes'])} takes of {report['takes'][0]['frames']} frames"


def main(shots: Path, baked: Path) -> int:
    """All scenes; how many could not be baked."""
    failed = 0
    baked.mkdir(parents=True, exist_ok=True)
    for scene in sorted(shots.glob("*.blend")):
        out = baked / scene.name
        if out.exists():
            continue
        print(f"{scene.name}: {bake(scene, out)}", flush=True)
        failed += not out.exists()
    return failed


if __name__ == "__main__":
    sys.exit(min(1, main(Path(sys.argv[1]), Path(sys.argv[2]))))
