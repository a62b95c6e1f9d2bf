"""SAMP, the baseline: what its state says of known motions, that its network mixes experts and
learns, and that it walks on.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs torch")

from dafnet_addon.baselines import samp, samp_features, samp_state  # noqa: E402
from dafnet_addon.baselines.samp import (  # noqa: E402
    Blended,
    MotionNet,
    SampConfig,
    SampTraining,
    network_of,
    sample_takes,
)
from dafnet_addon.core.conditions import Shot  # noqa: E402
from dafnet_addon.core.root import RootPath, ahead, velocities  # noqa: E402
from dafnet_addon.core.rotations import rotate, yaw_matrix  # noqa: E402
from dafnet_addon.core.skeleton import OFFSETS, PARENTS, REST, SEAT_TO_PELVIS, joint  # noqa: E402
from dafnet_addon.data.dataset.prepare import POSE_UNIT  # noqa: E402
from dafnet_addon.data.furnish.boxes import ABSENT, MOST, NO_BOXES, box  # noqa: E402
from dafnet_addon.data.furnish.shapes import ABSENT_SHAPE, SHAPES  # noqa: E402
from dafnet_addon.data.held_out.captured import HeldClip  # noqa: E402
from dafnet_addon.training import precision  # noqa: E402
from dafnet_addon.training.batches import Pool  # noqa: E402
from dafnet_addon.training.evaluation.clips import shot_of  # noqa: E402

pytestmark = pytest.mark.torch

TINY = SampConfig(width=24, code=16, experts=3, latent=8)
STEP = 0.04  # metres a frame


def _seated() -> np.ndarray:
    """A body on a seat of 0.43 m."""
    out = REST.copy()
    out[:, 2] += 0.43 + SEAT_TO_PELVIS - REST[0, 2]
    for side, x in (("left", -0.09), ("right", 0.09)):
        out[joint(f"{side}_knee")] = x, 0.41, 0.48
        out[joint(f"{side}_ankle")] = x, 0.41, 0.08
        out[joint(f"{side}_foot")] = x, 0.54, 0.02
    return out


def _path(step: float, frames: int, place: tuple[float, float], yaw: float) -> RootPath:
    """Straight on from ``place``, looking along ``yaw``."""
    way = np.arange(frames)[:, None] * rotate(yaw_matrix(np.array(yaw)), np.array([0.0, step, 0.0]))
    return RootPath(way + np.array([*place, 0.0]), np.full(frames, yaw))


def _windows(
    pose: np.ndarray,
    step: float = STEP,
    place: tuple[float, float] = (0.0, 0.0),
    yaw: float = 0.0,
    count: int = 1,
    boxes: np.ndarray = NO_BOXES,
) -> dict[str, np.ndarray]:
    """Windows of a body that is carried along like a statue."""
    path = _path(step, 111, place, yaw)
    rows = np.tile(ABSENT, (MOST, 1))
    rows[: len(boxes)] = boxes
    window = {
        "poses": np.round(np.tile(pose.reshape(66), (80, 1)) / POSE_UNIT).astype(np.int16),
        "velocity": velocities(path)[1:81],
        "ahead": ahead(path)[11:81],
        "root": np.c_[path.position[11:81, :2], path.yaw[11:81]],
        "boxes": rows,
        "shapes": np.tile(ABSENT_SHAPE, (SHAPES, 1)),
    }
    return {name: np.stack([a] * count) for name, a in window.items()}


def _inputs(windows: dict[str, np.ndarray]) -> torch.Tensor:
    track, at = samp_features.window_tracks(windows, np.zeros(len(windows["poses"])))
    return samp_state.network_input(samp_features.states_at(track, at, at))


def test_a_state_has_the_papers_size():
    assert samp_state.STATE == 647 and samp_state.SENSOR == 2048
    assert _inputs(_windows(REST)).shape == (1, 50, 647)


def test_shares_of_experts_sum_to_one():
    net = network_of("samp", TINY)
    shares = net.shares(torch.randn(5, 8), torch.randn(5, 647))
    assert (
        shares.shape == (5, 3)
        and torch.allclose(shares.sum(-1), torch.ones(5))
        and (shares >= 0).all()
    )


def test_one_expert_is_a_linear_layer():
    layer, x = Blended(4, 6, 1), torch.randn(3, 4)
    assert torch.allclose(layer(x, torch.ones(3, 1)), layer.linear(x), atol=1e-6)


def test_blended_outputs_are_those_of_blended_weights():
    layer, x = Blended(4, 6, 5), torch.randn(3, 4)
    shares = torch.softmax(torch.randn(3, 5), dim=-1)
    weight, bias = layer.linear.weight.view(5, 6, 4), layer.linear.bias.view(5, 6)
    whole = torch.einsum("ne,eoi,ni->no", shares, weight, x) + shares @ bias
    assert torch.allclose(layer(x, shares), whole, atol=1e-6)


def test_a_straight_walk_is_sampled_where_it_was_and_will_be():
    parts, from_goal = samp_state.split_state(_inputs(_windows(REST)))
    way = STEP * torch.arange(-30, 31, 5)
    assert torch.allclose(parts.trajectory[..., 0], torch.zeros(13), atol=1e-5)
    assert torch.allclose(parts.trajectory[..., 1], way.expand(1, 50, 13), atol=1e-5)
    assert torch.allclose(parts.trajectory[..., 2:4], torch.tensor([0.0, 1.0]), atol=1e-5)
    assert (parts.trajectory[..., 4:].argmax(-1) == samp_state.ACTIONS.index("walk")).all()
    pose = parts.pose[0, 0]
    assert torch.allclose(pose[:, :3], torch.from_numpy(REST).float(), atol=1e-4)
    assert torch.allclose(pose[0, 3:9], torch.tensor([0.0, 1, 0, 0, 0, 1]), atol=1e-3)
    assert torch.allclose(pose[:, 9:], torch.tensor([0.0, STEP * 30, 0.0]), atol=1e-3)
    goal = parts.goal[..., samp_state.NOW, :]
    assert (goal[..., 0].abs() < 1e-5).all() and torch.allclose(
        goal[..., 3:5], torch.tensor([0.0, 1.0]), atol=1e-5
    )
    assert goal[..., 1].min() > 29 * STEP and goal[..., 1].max() < 81 * STEP, (
        "a way point is one to 2.7 seconds ahead"
    )
    assert torch.allclose(from_goal[..., samp_state.NOW, 1], -goal[..., 1], atol=1e-5)


def test_states_do_not_know_where_in_the_world_they_are():
    at_seat = {"pose": _seated(), "step": 0.0}
    for kind in ({"pose": REST}, at_seat):
        here, there = (
            _inputs(_windows(**kind)),
            _inputs(_windows(**kind, place=(3.0, -2.0), yaw=2.3)),
        )
        assert (here - there).abs().max() < 2e-3
    seat = box((0.0, 0.0, 0.215), (0.5, 0.4, 0.43))
    turned = box((3.0, -2.0, 0.215), (0.5, 0.4, 0.43), 2.3)
    seen = []
    for windows in (
        _windows(**at_seat, boxes=seat[None]),
        _windows(**at_seat, place=(3.0, -2.0), yaw=2.3, boxes=turned[None]),
    ):
        track, at = samp_features.window_tracks(windows, np.zeros(1))
        aim = samp_features.states_at(track, at, at).goal[:, :, samp_state.NOW]
        seen.append(samp_state.sensor_of(track.solid[track.which[:, at]], aim))
    assert (seen[0] - seen[1]).abs().max() < 2e-3
    voxels = seen[0][0, 0].view(512, 4)
    inside = (voxels[:, 0].abs() < 0.2) & (voxels[:, 1].abs() < 0.2) & (voxels[:, 2] < 0.43)
    assert (voxels[inside, 3] == 1).all() and (voxels[voxels[:, 2] > 0.7, 3] == 0).all()


def test_a_seated_body_sits_at_its_goal():
    parts, _ = samp_state.split_state(_inputs(_windows(_seated(), step=0.0)))
    goal = parts.goal[..., samp_state.NOW, :]
    assert torch.allclose(goal[..., :3], torch.tensor([0.0, 0.0, 0.43]), atol=1e-3)
    sits = samp_state.ACTIONS.index("sit")
    assert (
        torch.allclose(goal[..., 6 + sits], torch.tensor(1.0))
        and (parts.trajectory[..., 4 + sits] > 0.99).all()
    )
    assert (parts.contacts[..., 4] == 1).all() and (parts.contacts[..., :2] == 1).all()


def test_a_root_that_will_stay_over_a_seat_goes_there_to_sit():
    windows = _windows(REST)
    end = RootPath(
        np.c_[windows["root"][0, :, :2], np.zeros(70)], windows["root"][0, :, 2]
    ).position[-1]
    windows["ahead"] = np.minimum(windows["ahead"], (end[1] - windows["root"][:, :, 1])[..., None])
    windows["boxes"][0, 0] = box((end[0], end[1], 0.2), (0.5, 0.5, 0.4))
    goal = samp_state.split_state(_inputs(windows))[0].goal[0, -1, samp_state.NOW]
    assert goal[6 + samp_state.ACTIONS.index("sit")] == 1 and abs(float(goal[2]) - 0.4) < 1e-6


def test_states_give_their_joints_back_and_follow_one_another():
    turning = _windows(REST, place=(1.0, 2.0), yaw=0.7)
    track, at = samp_features.window_tracks(turning, np.zeros(1))
    then = samp_features.states_at(track, at + 1, at)
    world = samp_state.points_back(then.pose[..., :3], track.root[:, at, None])
    assert (world - track.joints[:, at + 1 - track.first]).abs().max() < 1e-5
    after = samp_features.states_at(track, at + 1, at + 1)
    fed = samp_state.next_input(then, after.goal)
    assert (samp_state.network_input(fed) - samp_state.network_input(after)).abs().max() < 1e-4


@pytest.fixture
def pool(tmp_path: Path) -> Pool:
    """Six walks and six bodies on seats."""
    both = [_windows(REST, count=6), _windows(_seated(), step=0.0, count=6)]
    whole = {name: np.concatenate([w[name] for w in both]) for name in both[0]}
    whole = {name: a if a.dtype == np.int16 else a.astype(np.float32) for name, a in whole.items()}
    np.savez(tmp_path / "pool-0000.npz", kinds=np.array(["walk"] * 12), **whole)
    return Pool(lambda: [tmp_path / "pool-0000.npz"], torch.device("cpu"))


@pytest.mark.parametrize("kind", ["samp", "samp-ob"])
@pytest.mark.parametrize("share", [0.0, 0.45, 1.0])
def test_it_learns(pool, kind, share):
    torch.manual_seed(0)
    training = SampTraining(kind, TINY, pool.statistics(), torch.device("cpu"), pool)
    optimiser = torch.optim.Adam(training.network.parameters(), lr=5e-3)
    losses = []
    for _ in range(8):
        loss = training.loss(pool, torch.tensor([0, 3, 7, 11]), share)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(float(loss.detach()))
    assert np.isfinite(losses).all() and losses[-1] < 0.8 * losses[0]


def test_mixed_precision_is_nearly_the_same(pool):
    losses = []
    for mixed in (False, True):
        torch.manual_seed(0)
        training = SampTraining("samp", replace(TINY, mixed=mixed), pool.statistics(), "cpu", pool)
        losses.append(float(training.loss(pool, torch.arange(12), 0.0).detach()))
    assert abs(losses[0] - losses[1]) < 0.02 * losses[0]


def test_mixed_precision_is_asked_for_only_where_it_is_there(pool, monkeypatch):
    losses = {}
    for asked, there in ((False, False), (True, False), (True, True)):
        monkeypatch.setattr(precision, "is_available", lambda device, there=there: there)
        torch.manual_seed(0)
        training = SampTraining("samp", replace(TINY, mixed=asked), pool.statistics(), "cpu", pool)
        assert training.config.mixed is (asked and there)
        losses[asked, there] = float(training.loss(pool, torch.arange(12), 0.0).detach())
    assert losses[True, False] == losses[False, False] != losses[True, True]


def test_a_state_dict_says_all(pool):
    one = SampTraining("samp", TINY, pool.statistics(), "cpu", pool).network
    two = network_of("samp", TINY)
    two.load_state_dict(one.state_dict())
    assert (two.in_std == one.in_std).all() and one.in_std.min() < 1.0


@pytest.fixture(scope="module")
def walk() -> tuple[HeldClip, Shot]:
    """A statue that is carried for 40 frames, and what is known of it."""
    path = _path(STEP, 40, (1.0, 0.0), 0.5)
    joints = rotate(path.rotation[:, None], np.tile(REST, (40, 1, 1))) + path.position[:, None]
    clip = HeldClip("walk", "me", "walk", True, False, "", joints, path, NO_BOXES, ())
    return clip, shot_of(clip, "EE")


@pytest.mark.parametrize("kind", samp.KINDS)
def test_takes_are_bodies(walk, kind):
    torch.manual_seed(0)
    made = sample_takes(network_of(kind, TINY), *walk, [None, 0, 1], kind)
    assert made.shape == (3, 40, 22, 3) and np.isfinite(made).all()
    bones = np.linalg.norm(made[:, :, 1:] - made[:, :, list(PARENTS[1:])], axis=-1)
    assert np.abs(bones - np.linalg.norm(OFFSETS[1:], axis=-1)).max() < 1e-5
    again = sample_takes(network_of(kind, TINY), *walk, [None], kind)
    assert again.shape[0] == 1


def _statue(step: float) -> MotionNet:
    """A network that always makes the pose of the rest, and a root that goes straight on."""
    net = network_of("samp", TINY)
    with torch.no_grad():
        for parameter in net.third.parameters():
            parameter.zero_()
    track, at = samp_features.window_tracks(_windows(REST, step=step), np.zeros(1))
    now, then = samp_features.states_at(track, at, at), samp_features.states_at(track, at + 1, at)
    last, aim = (
        now.trajectory[:, :, samp_state.LAST, :4],
        samp_state.goal_place(now.goal[:, :, samp_state.NOW]),
    )
    net.measure("out", samp_state.state_of(then, last, aim), 1e-3)
    return net


def test_samp_goes_its_own_way_and_samp_a_the_clips(walk):
    clip, _ = walk
    slow = _statue(0.5 * STEP)
    with_root, own = (sample_takes(slow, *walk, [None], kind)[0] for kind in ("samp-a", "samp"))
    assert (
        np.linalg.norm(with_root[:, 0, :2] - clip.path.position[:, :2], axis=-1).max() < 1.1 * STEP
    )
    moved = np.linalg.norm(own[-1, 0, :2] - own[0, 0, :2])
    assert abs(moved - 39 * 0.5 * STEP) < 0.05, "half as fast as the clip"


def test_near_the_goal_the_trajectory_is_led_there():
    trajectory, from_goal = torch.zeros(1, 13, 9), torch.zeros(1, 13, 4)
    trajectory[..., 3], from_goal[..., 3] = 1.0, 1.0
    goal = torch.zeros(1, 13, 11)
    goal[..., 4] = 1.0
    parts = samp_state.Parts(torch.zeros(1, 22, 12), trajectory, torch.zeros(1, 5), goal)
    for distance, weight in ((0.05, (6 / 7) ** 0.25), (2.0, 0.0)):
        goal[..., 1] = distance
        led = samp_state.led_to_goal(parts, from_goal, goal).trajectory
        assert abs(float(led[0, -1, 1]) - weight * distance) < 1e-4 and float(led[0, 0, 1]) == 0.0
