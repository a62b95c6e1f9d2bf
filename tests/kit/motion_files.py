"""Writers of motion files whose joints are known: BVH, ASF/AMC, the compact form; and a made-up
walk.
"""

import json
from pathlib import Path

import numpy as np

from dafnet_addon.core.skeleton import JOINTS, PARENTS, REST
from dafnet_addon.data.capture.recording import rotation_about

MIXAMO = dict(
    zip(
        JOINTS,
        (
            "Hips",
            "LeftUpLeg",
            "RightUpLeg",
            "Spine",
            "LeftLeg",
            "RightLeg",
            "Spine1",
            "LeftFoot",
            "RightFoot",
            "Spine2",
            "LeftToeBase",
            "RightToeBase",
            "Neck",
            "LeftShoulder",
            "RightShoulder",
            "Head",
            "LeftArm",
            "RightArm",
            "LeftForeArm",
            "RightForeArm",
            "LeftHand",
            "RightHand",
        ),
        strict=True,
    )
)
Y_UP = [0, 2, 1], (1.0, 1.0, -1.0)  # a body in z-up axes as one in y-up axes that looks along -z


def _children(parent: int) -> list[int]:
    return [j for j, p in enumerate(PARENTS) if p == parent]


def write_bvh(
    file: Path,
    angles: np.ndarray,
    way: np.ndarray,
    order: str = "ZXY",
    fps: float = 30.0,
    unit: float = 0.01,
    up: str = "y",
    names: dict[str, str] = MIXAMO,
) -> np.ndarray:
    """Write a BVH of our rest skeleton, joints turned by ``angles`` (T, 22, 3) degrees about x, y,
    z in ``order``; its joints (T, 22, 3) in metres and the file's axes, by plain recursion.
    """
    rest = REST if up == "z" else REST[:, Y_UP[0]] * Y_UP[1]
    lines = ["HIERARCHY"]
    written: list[int] = []

    def write(j: int, depth: int) -> None:
        offset = (rest[j] - rest[PARENTS[j]]) / unit if j else np.zeros(3)
        channels = [f"{axis}rotation" for axis in order]
        if j == 0:
            channels = ["Xposition", "Yposition", "Zposition", *channels]
        pad = "\t" * depth
        lines.append(f"{pad}{'ROOT' if j == 0 else 'JOINT'} {names[JOINTS[j]]}\n{pad}{{")
        lines.append(f"{pad}OFFSET {' '.join(f'{x:.12g}' for x in offset)}")
        lines.append(f"{pad}CHANNELS {len(channels)} {' '.join(channels)}")
        written.append(j)
        for child in _children(j):
            write(child, depth + 1)
        if not _children(j):
            lines.append(f"{pad}End Site\n{pad}{{\n{pad}OFFSET 0 1 0\n{pad}}}")
        lines.append(f"{pad}}}")

    write(0, 0)
    columns = ["XYZ".index(axis) for axis in order]
    lines += ["MOTION", f"Frames: {len(angles)}", f"Frame Time: {1 / fps:.7f}"]
    for t, turned in enumerate(angles):
        numbers = list(way[t] / unit) + [float(turned[j, c]) for j in written for c in columns]
        lines.append(" ".join(f"{n:.9f}" for n in numbers))
    file.write_text("\n".join(lines), encoding="utf-8")

    out = np.zeros((len(angles), 22, 3))
    for t in range(len(angles)):
        frames: list[np.ndarray] = []
        for j in range(22):
            turn = np.eye(3)
            for axis in order:
                turn = turn @ rotation_about(
                    axis.lower(), np.radians(angles[t, j, "XYZ".index(axis)])
                )
            frames.append(turn if j == 0 else frames[PARENTS[j]] @ turn)
            out[t, j] = (
                way[t]
                if j == 0
                else out[t, PARENTS[j]] + frames[PARENTS[j]] @ (rest[j] - rest[PARENTS[j]])
            )
    return out


def walk(frames: int, up: str) -> tuple[np.ndarray, np.ndarray]:
    """Angles that swing the limbs a little, and a pelvis that goes forward at standing height."""
    rng = np.random.default_rng(4)
    phase = np.linspace(0, 3, frames)[:, None, None] + rng.uniform(0, 6, (1, 22, 3))
    angles = 8.0 * np.sin(phase) * (np.arange(22) > 0)[None, :, None]
    ahead = np.linspace(0, 1.5, frames)
    way = np.stack([0 * ahead, ahead, 0 * ahead + REST[0, 2]], -1)
    return angles, way if up == "z" else way[:, Y_UP[0]] * Y_UP[1]


ASF = """# made by a test
:version 1.10
:name VICON
:units
  mass 1.0
  length 0.45
  angle deg
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
{bones}:hierarchy
  begin
{lines}
  end
"""
VICON = {
    "left_hip": "lfemur",
    "right_hip": "rfemur",
    "spine1": "upperback",
    "left_knee": "ltibia",
    "right_knee": "rtibia",
    "spine2": "thorax",
    "left_ankle": "lfoot",
    "right_ankle": "rfoot",
    "spine3": "lowerneck",
    "left_foot": "ltoes",
    "right_foot": "rtoes",
    "neck": "upperneck",
    "left_collar": "lclavicle",
    "right_collar": "rclavicle",
    "head": "head",
    "left_shoulder": "lhumerus",
    "right_shoulder": "rhumerus",
    "left_elbow": "lradius",
    "right_elbow": "rradius",
    "left_wrist": "lhand",
    "right_wrist": "rhand",
}


def write_asf(file: Path) -> np.ndarray:
    """Write our rest skeleton as an .asf; its joints (22, 3) in the file's units and axes.

    A bone of .asf has one end only: a fixed one leads to each joint, at which one without length
    turns.
    """
    rest = REST[:, Y_UP[0]] * Y_UP[1] / (0.0254 / 0.45)
    fixed = {"left_hip": "lhipjoint", "right_hip": "rhipjoint", "spine1": "lowerback"}
    bones, lines = "", []
    for j in range(1, 22):
        parent = VICON.get(JOINTS[PARENTS[j]], "root")
        link = fixed.get(JOINTS[j], f"to_{VICON[JOINTS[j]]}")
        offset = rest[j] - rest[PARENTS[j]]
        length = float(np.linalg.norm(offset))
        direction = " ".join(f"{x:.12g}" for x in offset / length)
        bones += (
            f"  begin\n id {j}\n name {link}\n direction {direction}\n length {length:.12g}\n "
            "axis 0 0 0 XYZ\n  end\n"
            f"  begin\n id {j + 50}\n name {VICON[JOINTS[j]]}\n direction 0 1 0\n length 0\n axis "
            "20 -30 40 XYZ\n"
            "dof rx ry rz\n limits (-180 180)\n (-180 180)\n (-180 180)\n  end\n"
        )
        lines += [f"    {parent} {link}", f"    {link} {VICON[JOINTS[j]]}"]
    file.write_text(ASF.format(bones=bones, lines="\n".join(lines)), encoding="utf-8")
    return rest


def write_amc(file: Path, angles: np.ndarray, way: np.ndarray) -> None:
    lines = [":FULLY-SPECIFIED", ":DEGREES"]
    for t, turned in enumerate(angles):
        lines.append(f"{t + 1}\nroot {' '.join(f'{x:.9f}' for x in [*way[t], *turned[0]])}")
        lines += [
            f"{VICON[JOINTS[j]]} {' '.join(f'{x:.9f}' for x in turned[j])}" for j in range(1, 22)
        ]
    file.write_text("\n".join(lines), encoding="utf-8")


def write_compact(file: Path, clips: list[tuple[dict[str, str], np.ndarray]]) -> None:
    """Write clips of the compact form, each with what is known of it and its joints (T, 22, 3) in
    metres, z up, 30 fps.
    """
    millimetres = [np.round(joints * 1000).astype(np.int32) for _, joints in clips]
    np.savez(
        file,
        clips=json.dumps([info for info, _ in clips]),
        first_mm=np.stack([mm[0] for mm in millimetres]),
        delta_mm=np.concatenate([np.diff(mm, axis=0) for mm in millimetres]).astype(np.int16),
        frames=[len(mm) for mm in millimetres],
    )
