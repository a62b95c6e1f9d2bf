"""Reads the ground truth of a take back, and draws it over one of its rendered frames.

    python examples/read_truth.py FOLDER out.png --frame 121

``FOLDER`` is what ``dafnet bake … --truth --render frames`` or ``dafnet populate`` wrote: it holds
``truth`` and ``frames``. Every joint is drawn where it is: filled if the camera sees it, hollow if
something is before it. Crosses are the same joints, carried into the picture from the world by the
camera's matrices. docs/truth.md says what the numbers are. Needs NumPy and matplotlib.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from matplotlib import pyplot

BONES = [(1, 0), (2, 0), (3, 0), (4, 1), (5, 2), (6, 3), (7, 4), (8, 5), (9, 6), (10, 7), (11, 8)]
BONES += [(12, 9), (13, 9), (14, 9), (15, 12), (16, 13), (17, 14), (18, 16), (19, 17), (20, 18)]
BONES += [(21, 19)]


def carried(points: np.ndarray, camera: dict, index: int) -> np.ndarray:
    """Points (N, 3) of the world, metres, as pixels (N, 2) of a camera's picture."""
    there = np.column_stack([points, np.ones(len(points))]) @ np.transpose(
        camera["world_to_camera"][index]
    )
    flat = there[:, :3] @ np.transpose(camera["intrinsics"][index])
    return flat[:, :2] / flat[:, 2:]


def main(folder: Path, output: Path, frame: int | None = None, take: int = 1) -> list[str]:
    """Draw everybody in a frame (the middle one for None) of the first camera; what is drawn, as
    lines.
    """
    truth = folder / "truth" / f"take_{take}"
    scene = json.loads((truth / "scene.json").read_text(encoding="utf-8"))
    frames, camera = scene["camera_frames"], scene["cameras"][0]
    frame = frames[len(frames) // 2] if frame is None else frame
    index = frames.index(frame)

    picture = folder / "frames" / f"take_{take}" / camera["folder"] / f"{frame:04d}.png"
    figure = pyplot.figure(figsize=(camera["width"] / 100, camera["height"] / 100), dpi=200)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.imshow(pyplot.imread(picture), extent=(0, camera["width"], camera["height"], 0))

    said = []
    for person in scene["people"]:
        known = np.load(truth / f"{person['file']}.npz")
        if frame not in known["frames"]:
            continue
        at = int(np.flatnonzero(known["frames"] == frame)[0])
        points, seen = known["joints_2d"][0, index], known["joints_seen"][0, index]
        face, face_seen = known["coco_2d"][0, index, :5], known["coco_seen"][0, index, :5]
        again = carried(known["joints"][at], camera, index)
        assert np.nanmax(np.abs(again - points)) < 0.1, "the cameras' matrices say the same"

        (line,) = axes.plot([], [])
        for a, b in BONES:
            axes.plot(*points[[a, b]].T, color=line.get_color(), linewidth=1)
        for places, marks in ((points, seen), (face, face_seen)):
            axes.scatter(*places[marks == 2].T, s=9, color=line.get_color(), zorder=3)
            hidden = places[marks == 1].T
            axes.scatter(*hidden, s=9, facecolors="none", edgecolors=line.get_color(), zorder=3)
        axes.scatter(*again.T, s=4, marker="x", color="black", linewidths=0.4, zorder=4)

        touching = ", ".join(known["contact_names"][known["contacts"][at]]) or "nothing"
        task = known["task"][at]
        doing = known["tasks"][task] if task >= 0 else "without a task"
        said.append(
            f"{person['name']}: {doing}; touches {touching}; {(seen == 2).sum()} joints seen"
        )

    figure.savefig(output)
    pyplot.close(figure)
    return said


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("output", type=Path)
    parser.add_argument("--frame", type=int)
    parser.add_argument("--take", type=int, default=1)
    options = parser.parse_args()
    print("\n".join(main(options.folder, options.output, options.frame, options.take)))
