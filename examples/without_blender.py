"""A take in Python alone: somebody walks to a stool, sits on it for three seconds and gets up.

    .venv/bin/python examples/without_blender.py take.npz

NumPy is all that it needs. The file has ``joints`` (T, 22, 3), world, metres, z up, in SMPL's
order, and ``fps``.
"""

import sys
from pathlib import Path

import numpy as np

if __package__ is None:
    sys.path.insert(0, str(Path(__file__).absolute().parents[1]))

from dafnet_addon import Box, CleanUp, Controls, Scene, generate, load_weights
from dafnet_addon.core.paths import Stop, route

FPS = 30.0


def main(file: Path) -> None:
    """Generate, tell how high the pelvis comes to rest, and write the file."""
    stool = Box(center=np.array([0.0, 0.0, 0.225]), half_size=np.array([0.2, 0.2, 0.225]))
    start = Stop((2.5, 1.5), np.pi / 2)
    seat = Stop((0.0, 0.0), 0.0, seconds=3.0, seated=True)
    walked = route(start, seat, Stop((-2.0, 1.5), np.pi / 2), fps=FPS)

    take = generate(
        Scene([stool]),
        Controls(fps=FPS, root=walked.path.matrices()),
        load_weights(),
        seed=1,
        temperature=0.5,
        clean_up=CleanUp(feet=1.0, reach=1.0, seat=1.0),
    )
    lowest = take.joints[:, 0, 2].min()
    print(f"{len(take.joints)} frames; the pelvis comes down to {lowest:.2f} m over the floor.")
    np.savez_compressed(file, joints=take.joints, fps=FPS)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("take.npz"))
