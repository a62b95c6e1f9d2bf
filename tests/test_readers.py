"""Readers of motion capture: what is written with a known answer is read back; what is damaged is refused in one sentence."""

import json
from pathlib import Path

import numpy as np
import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.rotations import rotate
from dafnet_addon.core.skeleton import JOINTS, PARENTS, REST, TOE_HEIGHT, joint
from dafnet_addon.data.acclaim import read_amc, read_asf
from dafnet_addon.data.amass import read_amass
from dafnet_addon.data.boxes import box
from dafnet_addon.data.bvh import read_bvh
from dafnet_addon.data.canonical import calibrate
from dafnet_addon.data.cuts import bad_frames, cuts
from dafnet_addon.data.mocap import UNSTATED, Clip, read_clips
from dafnet_addon.data.recording import Recording, posed, rotation_about
from dafnet_addon.data.rigs import mapped, rigs
from dafnet_addon.data.sheet import sheet
from dafnet_addon.data.summary import summary
from dafnet_addon.data.world import at_model_rate, floor_height, unit_of

MOCAP = Path(__file__).resolve().parents[2] / "shared" / "data" / "mocap"
RAW = MOCAP / "raw_samples"
MIXAMO = dict(zip(JOINTS, (
    "Hips", "LeftUpLeg", "RightUpLeg", "Spine", "LeftLeg", "RightLeg", "Spine1", "LeftFoot", "RightFoot", "Spine2",
    "LeftToeBase", "RightToeBase", "Neck", "LeftShoulder", "RightShoulder", "Head", "LeftArm", "RightArm", "LeftForeArm",
    "RightForeArm", "LeftHand", "RightHand",
), strict=True))
Y_UP = [0, 2, 1], (1.0, 1.0, -1.0)  # a body in z-up axes as one in y-up axes that looks along -z


def _children(parent: int) -> list[int]:
    return [j for j, p in enumerate(PARENTS) if p == parent]


def _bvh(
    file: Path, angles: np.ndarray, way: np.ndarray, order: str = "ZXY", fps: float = 30.0, unit: float = 0.01, up: str = "y",
    names: dict[str, str] = MIXAMO,
) -> np.ndarray:
    """Write a BVH of our rest skeleton, joints turned by ``angles`` (T, 22, 3) degrees about x, y, z in ``order``; its joints
    (T, 22, 3) in metres and the file's axes, by plain recursion.
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
                turn = turn @ rotation_about(axis.lower(), np.radians(angles[t, j, "XYZ".index(axis)]))
            frames.append(turn if j == 0 else frames[PARENTS[j]] @ turn)
            out[t, j] = way[t] if j == 0 else out[t, PARENTS[j]] + frames[PARENTS[j]] @ (rest[j] - rest[PARENTS[j]])
    return out


def _walk(frames: int, up: str) -> tuple[np.ndarray, np.ndarray]:
    """Angles that swing the limbs a little, and a pelvis that goes forward at standing height."""
    rng = np.random.default_rng(4)
    phase = np.linspace(0, 3, frames)[:, None, None] + rng.uniform(0, 6, (1, 22, 3))
    angles = 8.0 * np.sin(phase) * (np.arange(22) > 0)[None, :, None]
    ahead = np.linspace(0, 1.5, frames)
    way = np.stack([0 * ahead, ahead, 0 * ahead + REST[0, 2]], -1)
    return angles, way if up == "z" else way[:, Y_UP[0]] * Y_UP[1]


def test_an_axis_turns_as_it_should():
    quarter = np.radians(90)
    for axis, start, end in (("x", [0, 1, 0], [0, 0, 1]), ("y", [0, 0, 1], [1, 0, 0]), ("z", [1, 0, 0], [0, 1, 0])):
        assert np.allclose(rotate(rotation_about(axis, np.array(quarter)), np.array(start, float)), end)


@pytest.mark.parametrize("order", ["ZXY", "XYZ", "YZX"])
def test_bvh_positions_are_those_of_its_angles(tmp_path, order):
    angles, way = _walk(12, "y")
    angles *= 8
    truth = _bvh(tmp_path / "a.bvh", angles, way, order, unit=0.0254)
    recording = read_bvh(tmp_path / "a.bvh")
    assert recording.rate == 30.0 and recording.names.count("LeftHand end") == 1
    joints, rest = mapped(recording, tmp_path / "a.bvh")
    assert np.abs(joints * 0.0254 - truth).max() < 1e-6
    assert np.abs((rest[12] - rest[0]) * 0.0254 - (REST[12] - REST[0])[Y_UP[0]] * Y_UP[1]).max() < 1e-6


@pytest.mark.parametrize(("up", "unit", "fps"), [("y", 0.01, 120), ("z", 1.0, 30), ("y", 0.0254, 24), ("z", 0.001, 60)])
def test_units_way_up_and_rate_are_found(tmp_path, up, unit, fps):
    frames = 2 * fps + 1
    angles, way = _walk(frames, up)
    truth = _bvh(tmp_path / "walk.bvh", angles, way, fps=fps, unit=unit, up=up)
    (clip,) = read_clips(tmp_path)
    truth = truth if up == "z" else truth[..., [0, 2, 1]] * (1, -1, 1)
    assert len(clip.joints) == 61
    read = clip.joints[::30] - clip.joints[0, 0]
    assert np.abs(read - (truth[::fps] - truth[0, 0])).max() < 1e-5, "whole seconds are whole frames in both"


def test_a_lying_body_shares_the_way_up_of_the_others_in_its_folder(tmp_path):
    angles, way = _walk(60, "y")
    _bvh(tmp_path / "walk.bvh", angles, way)
    lying = angles * 0
    lying[:, 0, 0] = 90.0  # on its face: the head lies along +z
    lying_truth = _bvh(tmp_path / "lie.bvh", lying, way * (0, 0, 0) + (0, 0.1, 0))
    assert lying_truth[0, 15, 2] - lying_truth[0, 0, 2] > 0.5
    clips = {c.name: c for c in read_clips(tmp_path)}
    assert clips["lie"].category == "lying" and np.ptp(clips["lie"].joints[0, :, 2]) < 0.4
    assert clips["lie"].joints[..., 2].min() > -0.01
    assert clips["walk"].joints[0, 15, 2] > 1.4


def test_the_floor_is_under_planted_toes():
    joints = np.repeat(REST[None], 60, axis=0) + np.array([0.3, 0.2, 1.7])
    swing = np.sin(np.linspace(0, 3, 30)) * 0.2
    joints[30:, joint("left_foot"), 2] += swing
    joints[30:, joint("left_foot"), 1] += np.linspace(0, 0.8, 30)
    assert abs(floor_height(joints) - 1.7) < 1e-6
    assert floor_height(joints - (0, 0, 1.7 + TOE_HEIGHT)) == pytest.approx(-TOE_HEIGHT)


def test_a_body_of_no_unit_is_refused():
    with pytest.raises(InputError, match="scale the file to metres"):
        unit_of(REST[None] * 7.0 / 0.82, None, Path("giant.bvh"))
    assert unit_of(REST[None] * 100, None, Path("a.bvh")) == 0.01
    assert unit_of(REST[None] / 0.0254, 0.0254, Path("a.amc")) == 0.0254
    assert unit_of(REST[None], 0.0254, Path("a.amc")) == 1.0, "what a file says of its units gives way to the body"


def test_resampling_keeps_time():
    ramp = np.linspace(0, 1, 121)[:, None, None] * np.ones((1, 22, 3))
    out = at_model_rate(ramp, 120.0)
    assert len(out) == 31 and np.allclose(out[:, 0, 0], np.linspace(0, 1, 31))
    assert len(at_model_rate(ramp, 24.0)) == 151


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
    "left_hip": "lfemur", "right_hip": "rfemur", "spine1": "upperback", "left_knee": "ltibia", "right_knee": "rtibia",
    "spine2": "thorax", "left_ankle": "lfoot", "right_ankle": "rfoot", "spine3": "lowerneck", "left_foot": "ltoes",
    "right_foot": "rtoes", "neck": "upperneck", "left_collar": "lclavicle", "right_collar": "rclavicle", "head": "head",
    "left_shoulder": "lhumerus", "right_shoulder": "rhumerus", "left_elbow": "lradius", "right_elbow": "rradius",
    "left_wrist": "lhand", "right_wrist": "rhand",
}


def _asf(file: Path) -> np.ndarray:
    """Write our rest skeleton as an .asf; its joints (22, 3) in the file's units and axes.

    A bone of .asf has one end only: a fixed one leads to each joint, at which one without length turns.
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
            f"  begin\n id {j}\n name {link}\n direction {direction}\n length {length:.12g}\n axis 0 0 0 XYZ\n  end\n"
            f"  begin\n id {j + 50}\n name {VICON[JOINTS[j]]}\n direction 0 1 0\n length 0\n axis 20 -30 40 XYZ\n"
            "dof rx ry rz\n limits (-180 180)\n (-180 180)\n (-180 180)\n  end\n"
        )
        lines += [f"    {parent} {link}", f"    {link} {VICON[JOINTS[j]]}"]
    file.write_text(ASF.format(bones=bones, lines="\n".join(lines)), encoding="utf-8")
    return rest


def _amc(file: Path, angles: np.ndarray, way: np.ndarray) -> None:
    lines = [":FULLY-SPECIFIED", ":DEGREES"]
    for t, turned in enumerate(angles):
        lines.append(f"{t + 1}\nroot {' '.join(f'{x:.9f}' for x in [*way[t], *turned[0]])}")
        lines += [f"{VICON[JOINTS[j]]} {' '.join(f'{x:.9f}' for x in turned[j])}" for j in range(1, 22)]
    file.write_text("\n".join(lines), encoding="utf-8")


def test_asf_and_amc_give_the_joints_of_their_angles(tmp_path):
    rest = _asf(tmp_path / "s.asf")
    angles, way = _walk(9, "y")
    way = way / (0.0254 / 0.45)
    _amc(tmp_path / "s_walk.amc", angles, way)
    # Acclaim: a bone turns by C M C⁻¹, each of C and M about x, then y, then z, all about fixed axes.
    def turn(degrees: np.ndarray) -> np.ndarray:
        x, y, z = (rotation_about(a, np.array(np.radians(d))) for a, d in zip("xyz", degrees, strict=True))
        return z @ y @ x

    axis = turn(np.array([20, -30, 40]))
    local = np.stack([
        np.stack([turn(a[0]), *(axis @ turn(a[j]) @ axis.T for j in range(1, 22))]) for a in angles
    ])
    offsets = np.repeat((rest - rest[list(PARENTS)])[None], 9, axis=0)
    offsets[:, 0] = way
    truth = posed(PARENTS, offsets, local)
    recording = read_amc(tmp_path / "s_walk.amc", read_asf(tmp_path / "s.asf"))
    assert recording.rate is None and recording.unit == pytest.approx(0.0254 / 0.45)
    for j, name in enumerate(JOINTS):
        read = recording.positions[:, recording.names.index(VICON.get(name, "root"))]
        assert np.abs(read - truth[:, j]).max() < 1e-6, name
    (clip,) = read_clips(tmp_path)
    assert len(clip.joints) == 3, "an .amc that does not say is taken as 120 frames a second"
    leg = np.linalg.norm(clip.joints[:, joint("left_knee")] - clip.joints[:, joint("left_hip")], axis=-1)
    assert np.allclose(leg, 0.41)


def test_an_amc_goes_with_the_asf_it_is_named_after(tmp_path):
    _asf(tmp_path / "s.asf")
    _asf(tmp_path / "s2.asf")
    angles, way = _walk(9, "y")
    _amc(tmp_path / "s2_walk.amc", angles, way)
    assert len(list(read_clips(tmp_path))) == 1
    (tmp_path / "s2_walk.amc").rename(tmp_path / "other.amc")
    with pytest.raises(InputError, match=r"2 \.asf files"):
        list(read_clips(tmp_path))


@pytest.mark.parametrize(("size", "rate_name"), [(156, "mocap_framerate"), (165, "mocap_frame_rate"), (72, "mocap_framerate")])
def test_amass_archives_are_posed_on_our_rest_skeleton(tmp_path, size, rate_name):
    poses = np.zeros((41, size))
    # AMASS: z up; the body looks along its own +z and stands along +y, so that a quarter turn about x sets it up.
    poses[:, 0] = np.pi / 2
    poses[:, 3 * joint("left_elbow") + 1] = -np.pi / 2  # the forearm forward
    way = np.stack([np.zeros(41), np.linspace(0, -2, 41), np.full(41, 5.0)], -1)
    np.savez(tmp_path / "01_01_poses.npz", poses=poses, trans=way, **{rate_name: 120.0}, betas=np.zeros(16), gender="male")
    recording = read_amass(tmp_path / "01_01_poses.npz")
    assert recording.names == JOINTS and recording.rate == 120.0
    (clip,) = read_clips(tmp_path)
    body = clip.joints[0] - clip.joints[0, 0]
    assert len(clip.joints) == 11 and np.allclose(clip.joints[-1, 0, 1] - clip.joints[0, 0, 1], -2)
    assert clip.joints[0, 0, 2] == pytest.approx(REST[0, 2]), "the floor is found"
    # It looks along −y, so its left is at +x and its forearm points along −y.
    assert body[joint("left_shoulder"), 0] > 0.1
    assert np.allclose(body[joint("left_wrist")] - body[joint("left_elbow")], (0, -0.25, 0), atol=1e-9)


def test_archives_that_are_no_motion_are_passed_over(tmp_path):
    np.savez(tmp_path / "shape.npz", betas=np.zeros(16))
    np.savez(tmp_path / "pool-000.npz", poses=np.zeros((3, 80, 66)), velocity=np.zeros(3))
    with pytest.raises(InputError, match="no motion files"):
        list(read_clips(tmp_path))


def test_what_is_known_of_a_clip_is_stated_beside_it(tmp_path):
    (tmp_path / "s1").mkdir()
    angles, way = _walk(12, "y")
    _bvh(tmp_path / "s1" / "WalkUp_01.bvh", angles, way)
    _bvh(tmp_path / "sit_on_chair.bvh", angles, way)
    clips = {c.name: c for c in read_clips(tmp_path)}
    assert clips["s1/WalkUp_01"].subject == "s1" and clips["s1/WalkUp_01"].category == "locomotion"
    assert clips["sit_on_chair"].category == "sit-stand" and clips["sit_on_chair"].source == tmp_path.name
    assert all(c.licence == UNSTATED and c.split == "" for c in clips.values()), "no licence, no training"

    (tmp_path / "clips.json").write_text(json.dumps({
        "*": {"licence": "CC0", "subject": "me"}, "s1/*": {"split": "test", "category": "work"},
    }), encoding="utf-8")
    clips = {c.name: c for c in read_clips(tmp_path)}
    assert [clips["s1/WalkUp_01"].split, clips["sit_on_chair"].split] == ["test", "train"]
    assert clips["s1/WalkUp_01"].category == "work" and {c.subject for c in clips.values()} == {"me"}
    (tmp_path / "clips.json").rename(tmp_path / "other.json")
    (tmp_path / "clips.csv").write_text("file,licence,fps,up\n*,CC BY,60,\n", encoding="utf-8")
    assert {c.licence for c in read_clips(tmp_path)} == {"CC BY"} and {len(c.joints) for c in read_clips(tmp_path)} == {6}
    for wrong in ("file,split\n*,all\n", "file,fps\n*,fast\n", "file,up\n*,x\n", "file,colour\n*,red\n", "file,up\n*,z,more\n"):
        (tmp_path / "clips.csv").write_text(wrong, encoding="utf-8")
        with pytest.raises(InputError, match="states for '\\*' what cannot be used") as error:
            list(read_clips(tmp_path))
        _one_sentence(error)
    for wrong in ("[1]", "{", '{"a.bvh": 3}'):
        (tmp_path / "clips.json").write_text(wrong, encoding="utf-8")
        with pytest.raises(InputError, match="does not list clips") as error:
            list(read_clips(tmp_path))
        _one_sentence(error)


def _one_sentence(error: pytest.ExceptionInfo[InputError]) -> None:
    text = str(error.value)
    assert text.endswith(".") and "\n" not in text and ";" in text and len(text) < 500, text


@pytest.mark.parametrize("damage", [
    lambda text: text[: len(text) // 3], lambda text: text[: -200], lambda text: text.replace("HIERARCHY", "HI", 1),
    lambda text: text.replace("Xrotation", "Wrotation", 1), lambda text: text.replace("Frames: 12", "Frames: 0"),
    lambda text: text.replace("Frame Time: 0.0333333", "Frame Time: nought"), lambda text: text + " nan", lambda text: "",
    lambda text: text.replace("}", "", 1), lambda text: text.replace("OFFSET", "OFFSETS", 1),
])
def test_a_damaged_bvh_is_refused_in_one_sentence(tmp_path, damage):
    angles, way = _walk(12, "y")
    _bvh(tmp_path / "a.bvh", angles, way)
    (tmp_path / "a.bvh").write_text(damage((tmp_path / "a.bvh").read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(InputError) as error:
        list(read_clips(tmp_path))
    _one_sentence(error)


@pytest.mark.parametrize(("file", "damage"), [
    ("s.asf", lambda text: text[: len(text) // 2]), ("s.asf", lambda text: text.replace(":units", ":unit")),
    ("s.asf", lambda text: text.replace("name ltibia", "name elsewhere")),
    ("s.asf", lambda text: text.replace("dof rx", "dof qx", 1)),
    ("s_a.amc", lambda text: text[:-60]), ("s_a.amc", lambda text: text.replace("ltibia", "tail")),
    ("s_a.amc", lambda text: ":DEGREES\n"), ("s_a.amc", lambda text: text.replace("root", "root x", 1)),
])
def test_damaged_acclaim_files_are_refused_in_one_sentence(tmp_path, file, damage):
    _asf(tmp_path / "s.asf")
    angles, way = _walk(5, "y")
    _amc(tmp_path / "s_a.amc", angles, way)
    (tmp_path / file).write_text(damage((tmp_path / file).read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(InputError) as error:
        list(read_clips(tmp_path))
    _one_sentence(error)


def test_damaged_archives_are_refused_in_one_sentence(tmp_path):
    good = {"poses": np.zeros((4, 156)), "trans": np.zeros((4, 3)), "mocap_framerate": 60.0}
    for wrong in (
        {"poses": np.zeros((4, 99))}, {"trans": np.zeros((3, 3))}, {"poses": np.full((4, 156), np.nan)},
        {"mocap_framerate": 0.0}, {"poses": np.zeros((0, 156)), "trans": np.zeros((0, 3))},
        {"poses": np.array([{}], dtype=object)},
    ):
        np.savez(tmp_path / "a.npz", **(good | wrong))
        with pytest.raises(InputError) as error:
            list(read_clips(tmp_path))
        _one_sentence(error)
    for content in (b"", b"PK\x03\x04 broken", b"nothing"):
        (tmp_path / "a.npz").write_bytes(content)
        with pytest.raises(InputError) as error:
            list(read_clips(tmp_path))
        _one_sentence(error)


def test_an_unknown_skeleton_names_what_it_lacks(tmp_path):
    names = MIXAMO | {"left_foot": "Zehe", "right_wrist": "Pfote"}
    angles, way = _walk(3, "y")
    _bvh(tmp_path / "a.bvh", angles, way, names=names)
    with pytest.raises(InputError, match=r"'mixamo' it lacks lefttoebase, righthand \(for left_foot, right_wrist\)") as error:
        list(read_clips(tmp_path))
    _one_sentence(error)


def test_a_prefix_and_case_do_not_hide_a_skeleton(tmp_path):
    angles, way = _walk(3, "y")
    _bvh(tmp_path / "a.bvh", angles, way, names={ours: f"mixamorig:{name.upper()}" for ours, name in MIXAMO.items()})
    assert len(list(read_clips(tmp_path))) == 1


def test_names_alone_do_not_make_a_skeleton(tmp_path):
    angles, way = _walk(3, "y")
    swapped = MIXAMO | {"left_knee": "LeftFoot", "left_ankle": "LeftLeg"}
    _bvh(tmp_path / "a.bvh", angles, way, names=swapped)
    with pytest.raises(InputError, match="does not hang from"):
        list(read_clips(tmp_path))
    recording = Recording(tuple(MIXAMO.values()), PARENTS, np.repeat(REST[None], 2, axis=0), REST, 30.0)
    recording.positions[:, joint("left_knee")] += (0, 0, 0.3)
    with pytest.raises(InputError, match="thigh"):
        mapped(recording, Path("a.bvh"))


def test_every_map_has_all_joints_with_weights_that_sum_to_one():
    assert {rig.name for rig in rigs()} >= {"cmu", "hdm05", "accad", "mixamo", "smpl", "snu"}
    for rig in rigs():
        assert set(rig.joints) == set(JOINTS) and rig.about
        assert all(sum(weights.values()) == pytest.approx(1.0) for weights in rig.joints.values()), rig.name


def _standing(frames: int) -> np.ndarray:
    """A body with hanging arms that sways a little."""
    joints = np.repeat(REST[None], frames, axis=0)
    for side, x in (("left_", -1), ("right_", 1)):
        shoulder = REST[joint(side + "shoulder")]
        joints[:, joint(side + "elbow")] = shoulder + np.array([0.03 * x, 0, -0.26])
        joints[:, joint(side + "wrist")] = shoulder + np.array([0.05 * x, 0.03, -0.50])
    return joints + 0.01 * np.sin(np.arange(frames) / 9)[:, None, None]


def test_good_frames_are_not_cut():
    assert cuts(_standing(120)) == [] and cuts(_standing(1)) == []


def test_bad_frames_are_cut_for_their_reasons():
    joints = _standing(200)
    joints[:30] = REST + 0.001 * np.sin(np.arange(30) / 9)[:, None, None]
    joints[60:66, joint("left_wrist")] = joints[60, joint("left_wrist")] + (0, 0.3, 0)
    joints[100:, :, :2] *= -1
    joints[150:] += (0.8, 0, 0)
    bad = bad_frames(joints)
    assert bad["T-pose"][:30].all() and not bad["T-pose"][31:].any()
    assert bad["dropout"][60:66].all() and not bad["dropout"][70:].any() and not bad["dropout"][:55].any()
    assert list(np.flatnonzero(bad["flip"])) == [99, 100]
    assert {149, 150} <= set(np.flatnonzero(bad["speed"]))
    found = cuts(joints)
    assert [c.start for c in found] == sorted(c.start for c in found) and {c.reason for c in found} == set(bad)


def test_the_summary_counts_minutes_clips_and_cuts(tmp_path):
    angles, way = _walk(90, "y")
    _bvh(tmp_path / "walk_1.bvh", angles, way)
    _bvh(tmp_path / "walk_2.bvh", angles, way)
    text = summary(read_clips(tmp_path))
    assert "2 clips" in text and "locomotion" in text and "0.1" in text and "2 clips are not trained on" in text
    assert "T-pose" in text, "the rest skeleton is a T-pose, swung a little"


def test_legs_are_measured_standing():
    """Legs from markers measure shorter when bent; a body scaled by that would hover over the floor when it stands."""
    joints = np.concatenate([_standing(60), _standing(200)])
    hips = [j for j in range(22) if j not in {joint(s + n) for s in ("left_", "right_") for n in ("ankle", "foot")}]
    joints[60:, hips] -= (0.0, 0.0, 0.3)  # lower, with shins as much shorter
    clip = Clip("a", "markers", "s1", "", "sit-stand", "train", "CC0", joints)
    assert calibrate([clip]).scale == pytest.approx(1.0, abs=1e-3)
    lying = Clip("b", "markers", "s1", "", "lying", "train", "CC0", joints[..., [0, 2, 1]] * (1, -1, 1))
    with pytest.raises(InputError, match="'markers/s1' never stands") as error:
        calibrate([lying])
    _one_sentence(error)


def test_a_sheet_is_drawn_for_any_length(tmp_path):
    pytest.importorskip("matplotlib")
    seat = box((0.0, 0.3, 0.4), (0.5, 0.5, 0.05))[None]
    touching = np.ones((30, 5), dtype=bool)
    plain, full = tmp_path / "plain.png", tmp_path / "full.png"
    sheet(plain, [("a pose", REST[None], None), ("a motion", _standing(30), None)], columns=3)
    sheet(full, [("a pose", REST[None], None), ("a motion", _standing(30), seat)], columns=3, contacts=[None, touching])
    assert 5_000 < plain.stat().st_size < full.stat().st_size, "furniture and contacts are drawn too"


@pytest.fixture(scope="module")
def pairs():
    """Clips that are there in their first form and in the compact one: (read, compact) joints."""
    if not RAW.is_dir():
        pytest.skip(f"needs the motion capture at {MOCAP}")
    raw = {c.name: c.joints for c in read_clips(RAW)}
    wanted = {
        "accad_male1_A9_lie_down": ("accad_male1", "Male1_A9_LieDown"), "accad_male1_B3_walk": ("accad_male1", "Male1_B3_Walk"),
        "cmu69_69_02_1": ("cmu69", "69_02_1"), "snu_chair": ("snu_tiling", "1/chair"),
        "cmu_daz_14_12_wash_windows": ("cmu_daz", "14/14_12"), "cmu_daz_14_30_sit_stepstool": ("cmu_daz", "14/14_30"),
        "snu_ys2010_walk_turn_180": ("snu_ys2010", "Walking/rawmotion/woddy2_walk_turn_180"),
        "hdm05_deposit_floor": ("hdm05_cuts", "train/1/HDM_bd_depositFloorR_001_120"),
    }
    compact = {(c.source, c.name): c.joints for c in read_clips(MOCAP)}
    return {name: (raw[name], compact[key]) for name, key in wanted.items()}


def test_real_files_are_read_as_their_compact_form_has_them(pairs):
    for name, (read, compact) in pairs.items():
        # The compact form left out frames at the start, or took its frames half-way between these.
        def apart(shift: float, read: np.ndarray = read, compact: np.ndarray = compact) -> np.ndarray:
            times = np.arange(len(compact)) + shift
            both = (times >= 0) & (times <= len(read) - 1)
            low = np.minimum(times[both].astype(int), len(read) - 2)
            share = (times[both] - low)[:, None, None]
            difference = read[low] * (1 - share) + read[low + 1] * share - compact[both]
            return np.linalg.norm(difference - difference[:, 0].mean(0), axis=-1)

        best = min((apart(shift) for shift in np.arange(-0.5, 2.01, 0.05)), key=lambda d: float(d.mean()))
        wrists = [joint("left_wrist"), joint("right_wrist")] if name.startswith("hdm05") else []  # ours lie at the hand's bone
        joints = [j for j in range(22) if j not in wrists]
        assert np.median(best[:, joints]) < 0.002 and np.percentile(best[:, joints], 99) < 0.012, name


def test_real_files_stand_on_the_floor(pairs):
    for name, (read, _) in pairs.items():
        toes = read[:, [joint("left_foot"), joint("right_foot")], 2].min(1)
        assert read[..., 2].min() > -0.05, name
        if "lie_down" not in name:
            assert abs(np.percentile(toes, 10) - TOE_HEIGHT) < 0.01 and 1.2 < read[0, 15, 2] < 1.8, name
