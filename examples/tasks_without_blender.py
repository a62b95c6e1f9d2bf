"""Tasks from a file, planned and generated in Python alone: somebody's morning in an office.

    .venv/bin/python examples/tasks_without_blender.py take.npz [tasks.toml]

NumPy is all that it needs. The file has ``joints`` (T, 22, 3), world, metres, z up, in SMPL's
order, and ``fps``.
"""

import sys
from pathlib import Path

import numpy as np

if __package__ is None:
    sys.path.insert(0, str(Path(__file__).absolute().parents[1]))

from dafnet_addon import Box, CleanUp, Scene, generate, load_weights
from dafnet_addon.director.planner import plan_tasks
from dafnet_addon.director.room import Room
from dafnet_addon.director.task_lists import read_task_file
from dafnet_addon.director.tasks import said


def box(name: str, low: tuple[float, ...], high: tuple[float, ...]) -> Box:
    """A box between two corners; boxes of one name are one piece."""
    a, b = np.array(low), np.array(high)
    return Box((a + b) / 2, (b - a) / 2, name=name)


def office() -> Room:
    """A chair at a desk, a whiteboard, and a counter with a cup on it."""
    return Room(
        solids=[
            box("Chair", (-0.22, -0.22, 0.40), (0.22, 0.22, 0.45)),
            box("Chair", (-0.22, -0.26, 0.45), (0.22, -0.22, 0.85)),
            box("Desk", (-0.70, 0.47, 0.70), (0.70, 1.17, 0.74)),
            box("Whiteboard", (-1.0, 3.0, 0.9), (1.0, 3.04, 2.0)),
            box("Counter", (2.5, -0.5, 0.0), (3.1, 1.5, 0.92)),
            box("Cup", (2.58, 0.2, 0.92), (2.65, 0.27, 1.02)),
        ],
        points={"Door": (-2.5, -1.0, 1.2)},
    )


def main(file: Path, tasks: Path) -> None:
    """Plan, tell what happens when, generate, and write the file."""
    room = office()
    plan = plan_tasks(room, read_task_file(tasks), start=(1.5, -2.0), seed=1)
    for entry in plan.timeline:
        there, stop = entry.there / plan.fps, entry.stop / plan.fps
        print(f"{there:5.1f} to {stop:4.1f} s  {said(entry.task)}")

    clean_up = CleanUp(feet=1.0, reach=1.0, seat=1.0)
    scene = Scene(list(room.solids))
    take = generate(scene, plan.controls(), load_weights(), temperature=0.5, clean_up=clean_up)
    np.savez_compressed(file, joints=take.joints, fps=plan.fps)


if __name__ == "__main__":
    main(
        Path(sys.argv[1]) if len(sys.argv) > 1 else Path("take.npz"),
        Path(sys.argv[2]) if len(sys.argv) > 2 else Path(__file__).with_name("tasks.toml"),
    )
