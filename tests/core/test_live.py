"""A body that is led as time runs: how it follows, and what is kept of it."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from dafnet_addon import Box, CleanUp, Controls, Scene, load_weights
from dafnet_addon.core.draws import Draw
from dafnet_addon.core.errors import InputError
from dafnet_addon.core.following import CRUISE, LAG, PointFollower, RootFollower, Seat, Way
from dafnet_addon.core.generate import played_take_steps
from dafnet_addon.core.live import Lead, LiveBody, LiveFrame, Surroundings, controls_of
from dafnet_addon.core.metrics import foot_sliding
from dafnet_addon.core.noise import TakeNoise
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.sampler import Conditions, Sampler
from dafnet_addon.core.series import MODEL_FPS
from dafnet_addon.core.skeleton import FEET, OFFSETS, PARENTS, PELVIS, WRISTS

FPS = MODEL_FPS
CHAIR = Scene(
    (
        Box(center=np.array([2.0, 3.0, 0.225]), half_size=np.array([0.22, 0.22, 0.225])),
        Box(center=np.array([2.0, 3.25, 0.7]), half_size=np.array([0.22, 0.03, 0.25])),
    )
)
SEAT = Seat(np.array([2.0, 2.98]), math.pi)


EMPTY = Scene()


def body(scene: Scene = EMPTY, scale: float = 1.0, **options) -> LiveBody:
    surroundings = Surroundings(scene, 0.0, scale)
    return LiveBody(
        Sampler(load_weights()), surroundings, Lead(np.zeros(3), 0.0), scale=scale, **options
    )


def led(
    live: LiveBody, seconds: float, place: tuple[float, float], temperature: float = 0.5, **targets
) -> list[LiveFrame]:
    """The frames in which it is led to a place, where the root is at once."""
    lead = Lead(np.array([*place, 0.0]), 0.0, targets)
    return [live.step(lead, temperature) for _ in range(round(seconds * FPS))]


def test_single_steps_give_what_a_run_gives() -> None:
    sampler, frames = Sampler(load_weights()), 40
    rng = np.random.default_rng(0)
    conditions = Conditions(
        velocity=rng.normal(0.0, 0.01, (frames, 3)),
        ahead=np.full((frames, 24), np.nan),
        occupancy=(rng.random((frames, 2640)) < 0.1).astype(float),
        observation=rng.normal(0.0, 0.5, (frames, 66)),
        given=(rng.random((frames, 22)) < 0.1).astype(float),
    )
    noise = rng.normal(0.0, 1.0, (frames, 2, 66))
    whole = run_to_end(sampler.run(conditions, noise))
    sampler.forget(2)
    for t in range(frames):
        seen = conditions.between(max(0, t - 20), t + 1)
        step = sampler.step(seen, noise[t])
        assert np.abs(step.poses[0] - whole.poses[t]).max() < 1e-4
        assert np.abs(step.actions[0] - whole.actions[t]).max() < 1e-4
        assert np.abs(step.log_likelihood[0] - whole.log_likelihood[t]).max() < 1e-2


@pytest.mark.parametrize("held", [False, True])
def test_noise_streams_as_it_is_drawn(held: bool) -> None:
    noise = Sampler(load_weights()).network.noise
    for source in (noise, TakeNoise.standard_normal()):
        drawn = source.draw(120, 3, 8, held=held)
        streamed = np.array(list(itertools.islice(source.stream(3, 8, held), 120)))
        assert np.abs(drawn - streamed).max() < 1e-9


def test_a_root_that_jumps_is_followed_as_people_go() -> None:
    rng = np.random.default_rng(1)
    follower, places, yaws = RootFollower(np.zeros(3), 0.0), [], []
    goal, yaw = np.zeros(3), 0.0
    for k in range(1800):
        if k % 40 == 0:
            goal, yaw = np.append(rng.uniform(-4, 4, 2), 0.0), rng.uniform(-9, 9)
        follower.step(goal + rng.normal(0.0, 0.02, 3), yaw)
        places.append(follower.position.copy())
        yaws.append(follower.yaw)
    velocity = np.diff(np.array(places)[:, :2], axis=0) * FPS
    assert np.linalg.norm(velocity, axis=1).max() < 1.02 * CRUISE
    assert np.linalg.norm(np.diff(velocity, axis=0), axis=1).max() * FPS < 4.1
    assert np.abs(np.diff(yaws)).max() * FPS < math.radians(151.0)


def test_it_arrives_without_going_past_and_is_as_late_as_is_said() -> None:
    follower = RootFollower(np.zeros(3), 0.0)
    went = []
    for _ in range(240):
        follower.step(np.array([0.0, 2.0, 0.0]), 0.0)
        went.append(follower.position[1])
    assert np.diff(went).min() > -1e-3 and abs(went[-1] - 2.0) < 0.01
    goal = 0.0
    for _ in range(300):
        goal += 1.0 / FPS
        follower.step(np.array([0.0, 2.0 + goal, 0.0]), 0.0)
    assert abs((2.0 + goal - follower.position[1]) - LAG * 1.0) < 0.05
    point = PointFollower(np.zeros(3), 0.1, 3.0)
    reached = np.array([point.step(np.array([0.3, 0.0, 0.0])) for _ in range(60)])
    assert reached[-1, 0] > 0.299 and reached[:, 0].max() < 0.3001


def test_it_looks_where_it_goes_and_as_the_root_when_it_is_there() -> None:
    follower = RootFollower(np.zeros(3), 0.0)
    ways = []
    for _ in range(240):
        follower.step(np.array([3.0, 0.0, 0.0]), 0.0)
        ways.append(follower.yaw)
    assert min(ways) < -math.radians(80.0), "it looked to the right on its way"
    assert abs(ways[-1]) < 0.05
    for _ in range(60):
        follower.step(np.array([2.8, 0.0, 0.0]), 0.0)
        assert abs(follower.yaw) < 0.2, "a small step aside needs no turn"


def test_who_is_dragged_backwards_on_and_on_turns_round() -> None:
    follower, y = RootFollower(np.zeros(3), 0.0), 0.0
    for _ in range(120):
        y -= 0.4 / FPS
        follower.step(np.array([0.0, y, 0.0]), 0.0)
    assert math.cos(follower.yaw) < -0.9, "nobody walks backwards for metres"
    for _ in range(120):
        follower.step(np.array([0.0, y, 0.0]), 0.0)
    assert math.cos(follower.yaw) > 0.99


@pytest.mark.parametrize("start", [(0.0, 0.0), (2.0, 5.0), (3.5, 3.2), (2.1, 2.2)])
def test_a_seat_is_come_to_from_in_front_and_left_ahead(start: tuple[float, float]) -> None:
    follower = RootFollower(np.array([*start, 0.0]), 0.3)
    for _ in range(450):
        follower.step(np.array([2.05, 3.0, 0.0]), 0.0, [SEAT])
        off = follower.position[:2] - SEAT.position
        if np.linalg.norm(off) < 0.3:
            turned = (follower.yaw - SEAT.yaw + np.pi) % (2 * np.pi) - np.pi
            assert off[1] < 0.1 and abs(off[0]) < 0.2 and abs(turned) < 0.7
    assert np.linalg.norm(follower.position[:2] - SEAT.position) < 0.03
    for _ in range(300):
        follower.step(np.array([2.0, 5.0, 0.0]), 0.0, [SEAT])
        off = follower.position[:2] - SEAT.position
        assert not (np.linalg.norm(off) < 0.3 and off[1] > 0.05), "not through its back"
        if follower.seat is None:
            break
    assert follower.seat is None


def test_a_seat_that_is_found_late_is_come_to_from_in_front_as_well() -> None:
    follower = RootFollower(np.append(SEAT.position, 0.0), SEAT.yaw)
    ahead = []
    for _ in range(300):
        follower.step(np.array([2.0, 2.98, 0.0]), 0.0, [SEAT])
        ahead.append(SEAT.position[1] - follower.position[1])
    assert max(ahead) > 0.3, "nobody sits down inside of a seat"
    assert np.linalg.norm(follower.position[:2] - SEAT.position) < 0.03


def test_what_leads_along_a_way_waits_for_the_body() -> None:
    way = Way()
    for x in np.linspace(0.0, 3.0, 61):
        way.add(np.array([x, 0.0]))
    place, yaw = way.lead(np.zeros(2), np.zeros(2), 300)
    assert 0.6 < place[0] < 0.8 and yaw is not None, "no farther ahead"
    place, yaw = way.lead(place, np.zeros(2), 30)
    assert yaw is None
    for _ in range(200):
        place, yaw = way.lead(place, place, 1)
    assert not way and abs(place[0] - 3.0) < 1e-6


@pytest.mark.slow
def test_it_walks_and_stops_and_lives_with_its_feet_on_the_floor() -> None:
    live = body()
    frames = led(live, 4.0, (0.0, 2.5)) + led(live, 4.0, (0.0, 2.5))
    joints = np.array([frame.joints for frame in frames])
    assert np.linalg.norm(joints[-1, PELVIS, :2] - (0.0, 2.5)) < 0.1
    rest = joints[-60:]
    assert rest[:, PELVIS, 2].min() > 0.85
    heights = rest[:, FEET, 2]
    assert heights.min(axis=1).max() < 0.03 and heights.max() < 0.15, "one may be put elsewhere"
    assert 0.002 < np.ptp(rest[:, WRISTS], axis=0).max() < 0.3, "it lives"
    feet = np.linalg.norm(np.diff(rest[:, FEET, :2], axis=0), axis=-1)
    assert np.median(feet) < 5e-4, "its feet stand"
    bones = joints[:, 1:] - joints[:, list(PARENTS[1:])]
    lengths = np.linalg.norm(bones, axis=-1) - np.linalg.norm(OFFSETS[1:], axis=-1)
    assert np.abs(lengths).max() < 1e-3
    jumps = np.linalg.norm(np.diff(joints, 2, axis=0), axis=-1) * FPS**2
    assert jumps.max() < 160.0, "nothing pops"

    raw = body(clean_up=CleanUp())
    loose = np.array([f.joints for f in led(raw, 4.0, (0.0, 2.5)) + led(raw, 3.0, (0.0, 2.5))])
    assert foot_sliding(joints, FPS).mean() < 0.8 * foot_sliding(loose, FPS).mean()


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1.0, 0.8])
def test_it_sits_down_and_is_carried(scale: float) -> None:
    live = body(CHAIR, scale, seats=[SEAT])
    frames = led(live, 10.0, (2.0, 3.0))
    assert abs(frames[-1].joints[PELVIS, 2] - (0.45 + 0.14 * scale)) < 0.04
    stood = led(live, 4.0, (0.0, 0.0))
    assert stood[-1].joints[PELVIS, 2] > 0.85 * scale


@pytest.mark.slow
def test_hands_reach_what_is_in_reach_alone() -> None:
    live = body()
    near, far = np.array([0.3, 0.4, 1.3]), np.array([0.3, 3.0, 1.3])
    frame = led(live, 1.5, (0.0, 0.0), hand_right=near)[-1]
    assert np.linalg.norm(frame.joints[WRISTS[1]] - near) < 0.06
    assert frame.shares == {"hand_right": 1.0}
    frames = led(live, 0.3, (0.0, 0.0), hand_right=near)
    frames += led(live, 1.2, (0.0, 0.0), hand_right=far)
    assert not frames[-1].shares and frames[-1].joints[WRISTS[1], 1] < 0.35
    wrist = np.array([each.joints[WRISTS[1]] for each in frames])
    jumps = np.linalg.norm(np.diff(wrist, 2, axis=0), axis=-1) * FPS**2
    assert jumps.max() < 40.0, "it does not fall, but is let down"


@pytest.mark.slow
@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0])
def test_what_was_played_is_a_take_of_any_rate(fps: float) -> None:
    live = body(CHAIR, seats=[SEAT])
    before = tuple(live.memory)
    played = led(live, 3.0, (1.0, 1.0)) + led(
        live, 1.0, (1.0, 1.0), hand_right=np.array([1.3, 1.4, 1.3])
    )
    controls = controls_of(played, fps, 1.0)
    take = run_to_end(
        played_take_steps(CHAIR, controls, before, played, CleanUp(1.0, 1.0), Draw(4))
    )
    assert take.draw == Draw(4)
    assert len(take) == len(controls) == int((len(played) - 1) * fps / 30 + 1e-6) + 1
    assert controls.mode == "EE" and len(take.poses) == 70 + len(take.path)
    seen = np.array([frame.joints for frame in played])
    at = np.rint(np.arange(len(take)) / fps * 30).astype(int)
    apart = np.linalg.norm(take.joints - seen[at], axis=-1)
    assert np.median(apart) < 0.02 and apart.max() < 0.25
    with pytest.raises(InputError, match="other frames"):
        run_to_end(played_take_steps(CHAIR, controls, before[:5], played, CleanUp(), Draw()))
    with pytest.raises(InputError, match="record for longer"):
        controls_of(played[:1], fps, 1.0)


def test_weights_that_must_know_the_way_ahead_are_refused() -> None:
    sampler = Sampler(load_weights())
    sizes = replace(sampler.network.sizes, ahead_mask=False)
    sampler.network = replace(sampler.network, sizes=sizes)
    with pytest.raises(InputError, match="live root"):
        LiveBody(sampler, Surroundings(Scene(), 0.0), Lead(np.zeros(3), 0.0))


def test_controls_of_what_was_played_are_like_any() -> None:
    frames = [
        LiveFrame(
            position=np.array([0.0, 0.03 * k, 0.0]),
            yaw=0.01 * k,
            joints=np.zeros((22, 3)),
            rotations=np.zeros((22, 4)),
            pose=np.zeros(66),
            action=np.zeros(10),
            log_likelihood=0.0,
            targets={},
            shares={},
        )
        for k in range(31)
    ]
    controls = controls_of(frames, 24.0, 1.1)
    assert isinstance(controls, Controls) and len(controls) == 25 and controls.mode == "FREE"
    assert np.allclose(controls.root[-1, :3, 3], (0.0, 0.9, 0.0)) and controls.scale == 1.1
