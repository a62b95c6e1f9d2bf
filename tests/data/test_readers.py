"""Motion files give the joints that their angles give, in metres, z up, 30 frames a second, on the
floor.
"""

from pathlib import Path

import numpy as np
import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.rotations import rotate
from dafnet_addon.core.skeleton import JOINTS, PARENTS, REST, TOE_HEIGHT, joint
from dafnet_addon.data.capture.acclaim import read_amc, read_asf
from dafnet_addon.data.capture.amass import read_amass
from dafnet_addon.data.capture.bvh import read_bvh
from dafnet_addon.data.capture.mocap import read_clips
from dafnet_addon.data.capture.recording import posed, rotation_about
from dafnet_addon.data.capture.rigs import mapped
from dafnet_addon.data.capture.world import at_model_rate, floor_height, unit_of
from kit.motion_files import (
    VICON,
    Y_UP,
    walk,
    write_amc,
    write_asf,
    write_bvh,
)
from kit.places import MOCAP, RAW


def test_an_axis_turns_as_it_should():
    quarter = np.radians(90)
    for axis, start, end in (
        ("x", [0, 1, 0], [0, 0, 1]),
        ("y", [0, 0, 1], [1, 0, 0]),
        ("z", [1, 0, 0], [0, 1, 0]),
    ):
        assert np.allclose(
            rotate(rotation_about(axis, np.array(quarter)), np.array(start, float)), end
        )


@pytest.mark.parametrize("order", ["ZXY", "XYZ", "YZX"])
def test_bvh_positions_are_those_of_its_angles(tmp_path, order):
    angles, way = walk(12, "y")
    angles *= 8
    truth = write_bvh(tmp_path / "a.bvh", angles, way, order, unit=0.0254)
    recording = read_bvh(tmp_path / "a.bvh")
    assert recording.rate == 30.0 and recording.names.count("LeftHand end") == 1
    joints, rest = mapped(recording, tmp_path / "a.bvh")
    assert np.abs(joints * 0.0254 - truth).max() < 1e-6
    assert (
        np.abs((rest[12] - rest[0]) * 0.0254 - (REST[12] - REST[0])[Y_UP[0]] * Y_UP[1]).max() < 1e-6
    )


@pytest.mark.parametrize(
    ("up", "unit", "fps"), [("y", 0.01, 120), ("z", 1.0, 30), ("y", 0.0254, 24), ("z", 0.001, 60)]
)
def test_units_way_up_and_rate_are_found(tmp_path, up, unit, fps):
    frames = 2 * fps + 1
    angles, way = walk(frames, up)
    truth = write_bvh(tmp_path / "walk.bvh", angles, way, fps=fps, unit=unit, up=up)
    (clip,) = read_clips(tmp_path)
    truth = truth if up == "z" else truth[..., [0, 2, 1]] * (1, -1, 1)
    assert len(clip.joints) == 61
    read = clip.joints[::30] - clip.joints[0, 0]
    assert np.abs(read - (truth[::fps] - truth[0, 0])).max() < 1e-5, (
        "whole seconds are whole frames in both"
    )


def test_a_lying_body_shares_the_way_up_of_the_others_in_its_folder(tmp_path):
    angles, way = walk(60, "y")
    write_bvh(tmp_path / "walk.bvh", angles, way)
    lying = angles * 0
    lying[:, 0, 0] = 90.0  # on its face: the head lies along +z
    lying_truth = write_bvh(tmp_path / "lie.bvh", lying, way * (0, 0, 0) + (0, 0.1, 0))
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
    assert unit_of(REST[None], 0.0254, Path("a.amc")) == 1.0, (
        "what a file says of its units gives way to the body"
    )


def test_resampling_keeps_time():
    ramp = np.linspace(0, 1, 121)[:, None, None] * np.ones((1, 22, 3))
    out = at_model_rate(ramp, 120.0)
    assert len(out) == 31 and np.allclose(out[:, 0, 0], np.linspace(0, 1, 31))
    assert len(at_model_rate(ramp, 24.0)) == 151


def test_asf_and_amc_give_the_joints_of_their_angles(tmp_path):
    rest = write_asf(tmp_path / "s.asf")
    angles, way = walk(9, "y")
    way = way / (0.0254 / 0.45)
    write_amc(tmp_path / "s_walk.amc", angles, way)

    # Acclaim: a bone turns by C M C⁻¹, each of C and M about x, then y, then z, all about fixed
    # axes.
    def turn(degrees: np.ndarray) -> np.ndarray:
        x, y, z = (
            rotation_about(a, np.array(np.radians(d))) for a, d in zip("xyz", degrees, strict=True)
        )
        return z @ y @ x

    axis = turn(np.array([20, -30, 40]))
    local = np.stack(
        [
            np.stack([turn(a[0]), *(axis @ turn(a[j]) @ axis.T for j in range(1, 22))])
            for a in angles
        ]
    )
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
    leg = np.linalg.norm(
        clip.joints[:, joint("left_knee")] - clip.joints[:, joint("left_hip")], axis=-1
    )
    assert np.allclose(leg, 0.41)


@pytest.mark.parametrize(
    ("size", "rate_name"),
    [(156, "mocap_framerate"), (165, "mocap_frame_rate"), (72, "mocap_framerate")],
)
def test_amass_archives_are_posed_on_our_rest_skeleton(tmp_path, size, rate_name):
    poses = np.zeros((41, size))
    # AMASS: z up; the body looks along its own +z and stands along +y, so that a quarter turn about
    # x sets it up.
    poses[:, 0] = np.pi / 2
    poses[:, 3 * joint("left_elbow") + 1] = -np.pi / 2  # the forearm forward
    way = np.stack([np.zeros(41), np.linspace(0, -2, 41), np.full(41, 5.0)], -1)
    np.savez(
        tmp_path / "01_01_poses.npz",
        poses=poses,
        trans=way,
        **{rate_name: 120.0},
        betas=np.zeros(16),
        gender="male",
    )
    recording = read_amass(tmp_path / "01_01_poses.npz")
    assert recording.names == JOINTS and recording.rate == 120.0
    (clip,) = read_clips(tmp_path)
    body = clip.joints[0] - clip.joints[0, 0]
    assert len(clip.joints) == 11 and np.allclose(clip.joints[-1, 0, 1] - clip.joints[0, 0, 1], -2)
    assert clip.joints[0, 0, 2] == pytest.approx(REST[0, 2]), "the floor is found"
    # It looks along −y, so its left is at +x and its forearm points along −y.
    assert body[joint("left_shoulder"), 0] > 0.1
    assert np.allclose(
        body[joint("left_wrist")] - body[joint("left_elbow")], (0, -0.25, 0), atol=1e-9
    )


@pytest.fixture(scope="module")
def pairs():
    """Clips that are there in their first form and in the compact one: (read, compact) joints."""
    raw = {c.name: c.joints for c in read_clips(RAW)}
    wanted = {
        "accad_male1_A9_lie_down": ("accad_male1", "Male1_A9_LieDown"),
        "accad_male1_B3_walk": ("accad_male1", "Male1_B3_Walk"),
        "cmu69_69_02_1": ("cmu69", "69_02_1"),
        "snu_chair": ("snu_tiling", "1/chair"),
        "cmu_daz_14_12_wash_windows": ("cmu_daz", "14/14_12"),
        "cmu_daz_14_30_sit_stepstool": ("cmu_daz", "14/14_30"),
        "snu_ys2010_walk_turn_180": ("snu_ys2010", "Walking/rawmotion/woddy2_walk_turn_180"),
        "hdm05_deposit_floor": ("hdm05_cuts", "train/1/HDM_bd_depositFloorR_001_120"),
    }
    compact = {(c.source, c.name): c.joints for c in read_clips(MOCAP)}
    return {name: (raw[name], compact[key]) for name, key in wanted.items()}


@pytest.mark.mocap
def test_real_files_are_read_as_their_compact_form_has_them(pairs):
    for name, (read, compact) in pairs.items():
        # The compact form left out frames at the start, or took its frames half-way between these.
        def apart(
            shift: float, read: np.ndarray = read, compact: np.ndarray = compact
        ) -> np.ndarray:
            times = np.arange(len(compact)) + shift
            both = (times >= 0) & (times <= len(read) - 1)
            low = np.minimum(times[both].astype(int), len(read) - 2)
            share = (times[both] - low)[:, None, None]
            difference = read[low] * (1 - share) + read[low + 1] * share - compact[both]
            return np.linalg.norm(difference - difference[:, 0].mean(0), axis=-1)

        best = min(
            (apart(shift) for shift in np.arange(-0.5, 2.01, 0.05)), key=lambda d: float(d.mean())
        )
        # ours lie at the hand's bone
        wrists = [joint("left_wrist"), joint("right_wrist")] if name.startswith("hdm05") else []
        joints = [j for j in range(22) if j not in wrists]
        assert np.median(best[:, joints]) < 0.002 and np.percentile(best[:, joints], 99) < 0.012, (
            name
        )


@pytest.mark.mocap
def test_real_files_stand_on_the_floor(pairs):
    for name, (read, _) in pairs.items():
        toes = read[:, [joint("left_foot"), joint("right_foot")], 2].min(1)
        assert read[..., 2].min() > -0.05, name
        if "lie_down" not in name:
            assert (
                abs(np.percentile(toes, 10) - TOE_HEIGHT) < 0.01 and 1.2 < read[0, 15, 2] < 1.8
            ), name
