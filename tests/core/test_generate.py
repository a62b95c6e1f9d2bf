"""From controls to takes with the weights that ship: modes, frame rates, sizes, resuming, and what
bad input is told.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from dafnet_addon import (
    Box,
    Controls,
    InputError,
    Mesh,
    Scene,
    Take,
    generate,
    generate_steps,
    load_weights,
)
from dafnet_addon.core.checks import MAX_SEED
from dafnet_addon.core.draws import Draw
from dafnet_addon.core.generate import takes_steps
from dafnet_addon.core.metrics import bone_length_variation, end_effector_distance
from dafnet_addon.core.paths import Stop, route
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.root import RootPath
from dafnet_addon.core.sampler import Sampler
from dafnet_addon.core.skeleton import END_EFFECTORS, UPPER


@pytest.fixture(scope="module")
def weights():
    return load_weights()


def _walk(fps: float = 30.0, seconds: float = 4.0, **more) -> Controls:
    walked = route(Stop((0.0, 0.0), 0.0, 0.5), Stop((0.0, 3.0), 0.0, 1.0), fps=fps).path
    count = min(len(walked), int(seconds * fps))
    return Controls(
        fps=fps, root=RootPath(walked.position[:count], walked.yaw[:count]).matrices(), **more
    )


def _seated(height: float = 0.45, mode="FREE", **more) -> tuple[Scene, Controls]:
    walked = route(Stop((-1.0, 2.5), np.pi, 0.4), Stop((0.0, 0.0), 0.0, 2.0, seated=True)).path
    seat = Box(
        center=np.array([0.0, 0.0, height / 2]), half_size=np.array([0.22, 0.22, height / 2])
    )
    return Scene((seat,)), Controls(fps=30, root=walked.matrices(), mode=mode, **more)


def test_walking_stands_and_bones_keep_their_length(weights):
    take = generate(Scene(), _walk(), weights)
    assert take.joints.shape == (len(_walk()), 22, 3) and np.isfinite(take.joints).all()
    assert (
        0.85 < np.median(take.joints[:, 0, 2]) < 1.02 and bone_length_variation(take.joints) < 1e-6
    )
    assert np.linalg.norm(take.joints[:, 0, :2] - take.root[:, :2, 3], axis=1).max() < 0.25
    assert np.allclose(np.linalg.norm(take.rotations, axis=-1), 1) and np.allclose(
        take.action.sum(-1), 1, atol=1e-5
    )
    assert any("no furniture" in w for w in take.warnings)


def test_sits_on_a_seat_and_stands_without_it(weights):
    scene, controls = _seated()
    on, off = generate(scene, controls, weights), generate(Scene(), controls, weights)
    assert abs(on.joints[-15, 0, 2] - (0.45 + 0.12)) < 0.08
    assert off.joints[-15, 0, 2] > 0.85


def test_the_same_seed_is_the_same_take_and_another_is_not(weights):
    scene, controls = _seated()
    one, two, other = (
        generate(scene, controls, weights, seed=s, temperature=0.8) for s in (3, 3, 4)
    )
    assert (
        np.abs(one.joints - two.joints).max() < 1e-4
        and np.abs(one.joints - other.joints).max() > 0.02
    )


def test_the_legs_vary_under_the_same_noise_of_the_trunk(weights):
    one = generate(*_seated(), weights, seed=1, lower_seed=1, temperature=1.0)
    two = generate(*_seated(), weights, seed=1, lower_seed=2, temperature=1.0)
    legs, trunk = ([4, 5, 7, 8], [9, 12, 15])
    assert (
        np.abs(one.joints[:, legs] - two.joints[:, legs]).mean()
        > np.abs(one.joints[:, trunk] - two.joints[:, trunk]).mean()
    )


def test_ee_draws_the_hand_to_its_target(weights):
    controls = _walk()
    free = generate(Scene(), controls, weights)
    target = free.joints[:, 20] + [0.0, 0.25, 0.25]
    asked = generate(Scene(), replace(controls, mode="EE", hand_left=target), weights)
    before = end_effector_distance(free.joints, {"hand_left": target})
    assert end_effector_distance(asked.joints, {"hand_left": target}) < 0.5 * before


def test_ee_without_targets_is_free(weights):
    controls = _walk()
    nothing = np.full((len(controls), 3), np.nan)
    free, empty = (
        generate(Scene(), controls, weights),
        generate(Scene(), replace(controls, mode="EE", head=nothing), weights),
    )
    assert np.abs(free.joints - empty.joints).max() < 1e-9


def test_full_follows_an_upper_body(weights):
    source = generate(*_seated(0.55), weights)
    scene, controls = _seated(0.55, mode="FULL", upper_body=source.joints[:, list(UPPER)])
    take = generate(scene, controls, weights)
    error = np.linalg.norm(take.joints - source.joints, axis=-1)[:, list(UPPER)].mean()
    assert error < 0.12
    free_pelvis = generate(scene, replace(controls, pelvis_given=False), weights)
    assert np.abs(free_pelvis.joints - take.joints).max() > 1e-4


def test_a_mode_for_each_frame_changes_without_a_pop(weights):
    controls = _walk()
    half = len(controls) // 2
    target = generate(Scene(), controls, weights).joints[:, 20] + [0.0, 0.3, 0.4]
    modes = ["FREE"] * half + ["EE"] * (len(controls) - half)
    take = generate(Scene(), replace(controls, mode=modes, hand_left=target), weights)
    wrist = take.joints[:, 20] - take.joints[:, 0]
    step = np.linalg.norm(np.diff(wrist, axis=0), axis=1)
    assert step[half - 1] < 0.08 and step.max() < 0.15


@pytest.mark.parametrize("fps", [23.976, 24, 25, 60])
def test_any_frame_rate_gives_the_same_motion(weights, fps):
    reference, other = (
        generate(Scene(), _walk(30.0), weights),
        generate(Scene(), _walk(fps), weights),
    )
    seconds = 2.0
    a, b = reference.joints[round(seconds * 30)], other.joints[round(seconds * fps)]
    assert len(other) == len(_walk(fps)) and np.abs(a - b).max() < 0.12


def test_a_smaller_character_is_the_same_motion_smaller(weights):
    scene, controls = _seated()
    root = controls.root.copy()
    root[:, :3, 3] *= 0.5
    small = Scene(
        tuple(replace(s, center=s.center * 0.5, half_size=s.half_size * 0.5) for s in scene.solids)
    )
    whole, half = (
        generate(scene, controls, weights),
        generate(small, replace(controls, root=root, scale=0.5), weights),
    )
    assert np.abs(half.joints - 0.5 * whole.joints).max() < 1e-6


def test_an_upper_storey_is_the_ground_floor_moved_up(weights):
    scene, controls = _seated()
    root = controls.root.copy()
    root[:, 2, 3] += 3.0
    up = Scene(tuple(replace(s, center=s.center + np.array([0, 0, 3.0])) for s in scene.solids))
    low, high = (
        generate(scene, controls, weights),
        generate(up, replace(controls, root=root), weights),
    )
    assert np.abs(high.joints - low.joints - [0, 0, 3.0]).max() < 1e-3


def test_furniture_that_moves_along_is_seen_where_it_is(weights):
    scene, controls = _seated()
    box = scene.solids[0]
    away = np.tile(box.center, (len(controls), 1))
    away[:, 0] += 5.0
    moving = Scene((replace(box, center=away, rotation=np.tile(np.eye(3), (len(controls), 1, 1))),))
    assert generate(moving, controls, weights).joints[-15, 0, 2] > 0.85


def test_resuming_keeps_what_was_and_goes_on(weights):
    scene, controls = _seated()
    first = generate(scene, controls, weights, seed=2, temperature=0.8)
    same = generate(
        scene, controls, weights, seed=2, temperature=0.8, resume=first, resume_frame=100
    )
    assert np.abs(same.joints - first.joints).max() < 2e-3
    other = generate(
        scene, controls, weights, seed=9, temperature=0.8, resume=first, resume_frame=100
    )
    assert np.abs(other.joints[:95] - first.joints[:95]).max() < 2e-3
    assert np.abs(other.joints[100:] - first.joints[100:]).max() > 0.02
    step = np.linalg.norm(np.diff(other.joints, axis=0), axis=-1).max(1)
    assert step[98:103].max() < 0.15


def test_progress_rises_to_one(weights):
    seen: list[float] = []
    assert isinstance(
        run_to_end(generate_steps(Scene(), _walk(seconds=1.0), weights), seen.append), Take
    )
    assert seen[0] == 0.0 and seen[-1] == 1.0 and all(a <= b for a, b in pairwise(seen))


def _changed(**values) -> Controls:
    return replace(_walk(seconds=1.0), **values)


def _broken_root() -> np.ndarray:
    root = _walk(seconds=1.0).root.copy()
    root[4, 0, 3] = np.nan
    return root


@pytest.mark.parametrize(
    ("controls", "words"),
    [
        (lambda: _changed(root=_broken_root()), "frame 4"),
        (lambda: _changed(root=np.zeros((0, 4, 4))), "at least one frame"),
        (lambda: _changed(fps=0.0), "frame rate"),
        (lambda: _changed(scale=-1.0), "scale"),
        (lambda: _changed(mode="HALF"), "FREE, EE or FULL"),
        (lambda: _changed(mode=["FREE"] * 3), "3 modes"),
        (lambda: _changed(mode="FULL"), "no upper body"),
        (lambda: _changed(mode="EE", head=np.zeros((2, 3))), "head"),
    ],
)
def test_bad_controls_are_refused_in_one_sentence(weights, controls, words):
    with pytest.raises(InputError, match=words) as caught:
        generate(Scene(), controls(), weights)
    assert str(caught.value).endswith(".") and "\n" not in str(caught.value)


EACH = {"root": np.tile(np.eye(4), (30, 1, 1))}
TURNS = np.tile(np.eye(3), (30, 1, 1))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"fps": None}, "frame rate is None"),
        ({"fps": "30"}, "frame rate is 30"),
        ({"fps": np.nan}, "frame rate is nan"),
        ({"fps": 1e-9}, "frame rate is 1e-09"),
        ({"fps": True}, "frame rate is True"),
        ({"fps": [30]}, "frame rate"),
        ({"scale": float("inf")}, "scale is inf"),
        ({"scale": 1e-300}, "scale"),
        ({"blend": np.nan}, "blend is nan"),
        ({"blend": np.inf}, "blend is inf"),
        ({"blend": None}, "blend is None"),
        ({"blend": -1.0}, "blend is -1"),
        ({"pelvis_given": "no"}, "'pelvis_given' is no"),
        ({"mode": None}, "mode is None"),
        ({"mode": 3}, "mode is 3"),
        ({"mode": ["EE", None] * 15}, "mode 'None'"),
        ({"mode": "ee"}, "mode 'ee'"),
        ({"mode": np.array(["EE"] * 29)}, "29 modes"),
        ({"root": None}, "root holds something other than numbers"),
        ({"root": [[1.0], [1.0, 2.0]]}, "root cannot be read"),
        ({"root": np.eye(4)}, "root has the shape"),
        ({"root": 1j * EACH["root"]}, "root holds something other than numbers"),
        ({"root": EACH["root"].astype(object)}, "root holds something other"),
        ({"root": 1e200 * EACH["root"]}, "root .*too far"),
        ({"fps": 1.0, "root": np.zeros((5000, 4, 4))}, "root has 5000 frames at 1 a second"),
        ({"head": np.full((30, 3), np.inf)}, "'head' holds an infinite number"),
        ({"head": "up"}, "'head' holds something other"),
        ({"head": np.zeros(3)}, "'head' has the shape"),
        ({"hand_left": np.full((30, 3), 1e30)}, "'hand_left' .*too far"),
        ({"head_rotation": TURNS[:-1]}, "'head_rotation' has the shape"),
        ({"head_rotation": np.eye(3)}, "'head_rotation'"),
        (
            {"hand_right_rotation": 2 * TURNS},
            "'hand_right_rotation' holds a matrix that is not a rotation",
        ),
        (
            {"hand_right_rotation": -TURNS},
            "'hand_right_rotation' holds a matrix that is not a rotation",
        ),
        ({"hand_left_influence": np.ones(29)}, "'hand_left_influence' has the shape"),
        (
            {"hand_left_influence": np.full(30, np.nan)},
            "'hand_left_influence' holds what is not a number",
        ),
        ({"upper_body": np.zeros((30, 22, 3))}, "'upper_body' has the shape"),
    ],
)
def test_controls_that_cannot_be_are_refused_where_they_are_made(given, words):
    with pytest.raises(InputError, match=words) as caught:
        Controls(**{"fps": 30.0, **EACH, **given})
    said = str(caught.value)
    assert said.endswith(".") and said.count(". ") == 0 and said.isprintable()


CUBE = {"center": [0.0, 1.0, 0.2], "half_size": [0.2, 0.2, 0.2]}
SHEET = {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]]}


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (
            lambda: Box(**CUBE | {"center": [np.nan, 0, 0]}),
            "center of the box 'box' holds what is not a number",
        ),
        (lambda: Box(**CUBE | {"center": [0, 0]}), "center of the box 'box' has the shape"),
        (
            lambda: Box(**CUBE | {"half_size": [0.2, -0.2, 0.2]}),
            "half_size of the box 'box' is negative",
        ),
        (
            lambda: Box(**CUBE | {"half_size": None}),
            "half_size of the box 'box' holds something other",
        ),
        (
            lambda: Box(**CUBE, rotation=np.full((3, 3), np.nan), name="Sofa"),
            "rotation of the box 'Sofa'",
        ),
        (
            lambda: Box(**CUBE, rotation=np.diag([1, 1, 2])),
            "rotation of the box 'box' holds a matrix that is not a rotation",
        ),
        (
            lambda: Box(**CUBE, rotation=np.diag([1, 1, -1])),
            "rotation of the box 'box' holds a matrix that is not a rotation",
        ),
        (
            lambda: Box(
                **CUBE | {"center": np.zeros((4, 3))}, rotation=np.tile(np.eye(3), (5, 1, 1))
            ),
            "4 and 5 frames",
        ),
        (lambda: Box(**CUBE | {"center": np.zeros((0, 3))}), "center .*0 and 1 frames"),
        (
            lambda: Mesh(**SHEET | {"triangles": [[0, 1, -1]]}),
            "triangles of the mesh 'mesh' name missing vertices",
        ),
        (
            lambda: Mesh(**SHEET | {"triangles": [[0, 1, 3]]}),
            "triangles of the mesh 'mesh' name missing vertices",
        ),
        (
            lambda: Mesh(**SHEET | {"triangles": [[0, 1, 1.5]]}),
            "triangles of the mesh 'mesh' hold what is not a whole number",
        ),
        (
            lambda: Mesh(**SHEET | {"triangles": [[0, 1, 2, 0]]}),
            "triangles of the mesh 'mesh' has the shape",
        ),
        (
            lambda: Mesh(**SHEET | {"vertices": [[0, 0, 0], [1, 0]]}),
            "vertices of the mesh 'mesh' cannot be read",
        ),
        (
            lambda: Mesh(**SHEET | {"vertices": "many"}),
            "vertices of the mesh 'mesh' holds something other",
        ),
        (lambda: Mesh(**SHEET, matrix=np.eye(3)), "matrix of the mesh 'mesh' has the shape"),
        (
            lambda: Mesh(**SHEET, matrix=np.full((4, 4), np.inf)),
            "matrix of the mesh 'mesh' .*not a number",
        ),
        (
            lambda: Mesh(**SHEET, matrix=np.zeros((0, 4, 4))),
            "matrix of the mesh 'mesh' has no frames",
        ),
        (lambda: Mesh(**SHEET, matrix=np.ones((4, 4))), "matrix of the mesh 'mesh' .*last row"),
        (lambda: Scene(None), "solids of a scene"),
        (lambda: Scene([SHEET]), "solids of a scene"),
    ],
)
def test_solids_that_cannot_be_are_refused_where_they_are_made(made, words):
    with pytest.raises(InputError, match=words) as caught:
        made()
    said = str(caught.value)
    assert said.endswith(".") and said.count(". ") == 0 and said.isprintable()


@pytest.mark.parametrize("frames", [2, 29, 31])
def test_solids_that_move_for_longer_or_shorter_than_the_root_are_refused(weights, frames):
    box = Box(**CUBE | {"center": np.zeros((frames, 3))}, name="Trolley")
    mesh = Mesh(**SHEET, matrix=np.tile(np.eye(4), (frames, 1, 1)), name="Trolley")
    for solid in (box, mesh):
        with pytest.raises(
            InputError,
            match=f"'Trolley' has {frames} frames and the root 30; give it one matrix or",
        ):
            generate(Scene([solid]), Controls(24.0, EACH["root"]), weights)


def test_what_is_neither_scene_nor_controls_is_refused(weights):
    for scene, controls in (
        (None, _walk()),
        ([], _walk()),
        (Scene(), None),
        (Scene(), {"fps": 30}),
    ):
        with pytest.raises(InputError, match="Scene and Controls"):
            generate(scene, controls, weights)


def test_lists_do_for_arrays(weights):
    scene, controls = _seated(mode="EE")
    hand = np.tile([0.3, 0.3, 1.0], (len(controls), 1))
    turns, share = np.tile(np.eye(3), (len(controls), 1, 1)), np.ones(len(controls))
    given = {"hand_left": hand, "hand_left_rotation": turns, "hand_left_influence": share}
    mesh = Mesh(np.array(SHEET["vertices"], float), np.array(SHEET["triangles"]), np.eye(4))
    arrays = generate(Scene((*scene.solids, mesh)), replace(controls, **given), weights)
    lists = generate(
        Scene(
            [
                Box(scene.solids[0].center.tolist(), scene.solids[0].half_size.tolist()),
                Mesh(**SHEET, matrix=np.eye(4).tolist()),
            ]
        ),
        Controls(
            30,
            controls.root.tolist(),
            ["EE"] * len(controls),
            **{name: each.tolist() for name, each in given.items()},
        ),
        weights,
    )
    # sums depend on where arrays lie in memory
    assert np.abs(arrays.joints - lists.joints).max() < 1e-9


@pytest.mark.parametrize(
    "seed",
    [-1, MAX_SEED + 1, 3_000_000_000, 1.0, 1.5, None, "7", True, float("nan"), 10**400, [1]],
)
def test_seeds_that_cannot_be_are_refused(seed):
    for given in ({"seed": seed}, {"lower_seed": seed}):
        if given != {"lower_seed": None}:
            with pytest.raises(
                InputError, match=f"The seed .*give a whole number from 0 to {MAX_SEED}"
            ):
                Draw(**given)


def test_seeds_of_numpy_are_seeds(weights):
    assert Draw(np.int64(7), np.uint8(3)) == Draw(7, 3) and type(Draw(np.int32(7)).seed) is int
    sampler = Sampler(weights)
    drawn = [sampler.noise(1, seed, held=True) for seed in (0, 1, MAX_SEED - 1, MAX_SEED)]
    assert (
        all(np.isfinite(each).all() for each in drawn)
        and len({each.tobytes() for each in drawn}) == 4
    )
    # As they have always been: NumPy's generator, seeded with the seed and the part's number.
    upper = np.random.default_rng([1, 0]).standard_normal(42)
    lasting = sampler.network.noise.lasting @ np.r_[upper, np.zeros(24)]
    assert np.allclose(drawn[1][0, 0, :42], lasting[:42])


def test_bad_temperature_and_bad_mesh_are_refused(weights):
    for temperature in (-1.0, 1e9, float("nan")):
        with pytest.raises(InputError, match="temperature"):
            generate(Scene(), _walk(seconds=1.0), weights, temperature=temperature)
    with pytest.raises(InputError, match="millions of metres"):
        Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1e30, 0]]), np.array([[0, 1, 2]]), name="torn")
    with pytest.raises(InputError, match="not a number"):
        Mesh(np.full((3, 3), np.nan), np.array([[0, 1, 2]]), name="broken")


def _warned(scene: Scene, controls: Controls, weights, words: str) -> Take:
    take = generate(scene, controls, weights)
    assert any(words in w for w in take.warnings), take.warnings
    assert np.isfinite(take.joints).all() and len(take) == len(controls)
    return take


def test_a_still_root_stands(weights):
    take = _warned(Scene(), _changed(root=np.tile(np.eye(4), (40, 1, 1))), weights, "does not move")
    assert take.joints[:, 0, 2].min() > 0.85


def test_a_single_frame_is_a_pose(weights):
    _warned(Scene(), _changed(root=np.eye(4)[None]), weights, "only one frame")


def test_a_tilted_root_is_flattened(weights):
    controls = _walk(seconds=1.0)
    tilt = np.eye(4)
    c, s = np.cos(0.4), np.sin(0.4)
    tilt[:3, :3] = [[1, 0, 0], [0, c, -s], [0, s, c]]
    tilted = _warned(Scene(), replace(controls, root=controls.root @ tilt), weights, "tilts")
    assert np.abs(tilted.joints - generate(Scene(), controls, weights).joints).max() < 1e-6


def test_a_jump_is_told(weights):
    root = _walk(seconds=2.0).root.copy()
    root[30:, 1, 3] += 5.0
    _warned(Scene(), _changed(root=root), weights, "jumps 5.0 m, 30 frames")


def test_a_root_through_furniture_is_told(weights):
    block = Box(center=np.array([0.0, 1.5, 0.75]), half_size=np.array([0.3, 0.3, 0.75]))
    _warned(Scene((block,)), _walk(), weights, "runs through furniture")


def test_targets_far_away_are_reached_for(weights):
    controls = _walk(seconds=2.0)
    far = np.tile([10.0, 0.0, 1.0], (len(controls), 1))
    take = _warned(Scene(), replace(controls, mode="EE", hand_right=far), weights, "reached for")
    free = generate(Scene(), controls, weights)
    hand = END_EFFECTORS["hand_right"]
    assert take.joints[:, hand, 0].mean() > free.joints[:, hand, 0].mean() + 0.1


def test_a_crowded_room_is_told(weights):
    block = Box(center=np.array([0.0, 1.0, 1.0]), half_size=np.array([3.0, 3.0, 1.0]))
    _warned(Scene((block,)), _walk(), weights, "more than the sensor can tell")


@pytest.mark.parametrize(("behind", "stands"), [(0.45, True), (0.0, False)])
def test_who_starts_beside_a_seat_stands_and_who_starts_over_it_sits(
    weights, behind: float, stands: bool
):
    seat = Box(center=np.array([0.0, -behind, 0.225]), half_size=np.array([0.22, 0.22, 0.225]))
    take = generate(Scene([seat]), Controls(30.0, np.tile(np.eye(4), (45, 1, 1))), weights)
    assert (take.joints[0, 0, 2] > 0.86) == stands


def test_takes_side_by_side_are_those_made_alone(weights):
    scene, controls = _seated()
    draws = [Draw(), Draw(3, None, 1.0), Draw(3, 4, 0.0, 1.0)]
    seen: list[np.ndarray] = []
    steps = takes_steps(
        scene, controls, weights, draws, watch=lambda frame, joints: seen.append(joints)
    )
    takes = run_to_end(steps)
    assert len(takes) == 3 and len(seen) == len(controls)
    for take, draw in zip(takes[:2], draws, strict=False):
        alone = generate(scene, controls, weights, seed=draw.seed, temperature=draw.temperature)
        assert np.abs(take.joints - alone.joints).max() < 2e-3
        assert abs(take.log_likelihood - alone.log_likelihood) < 0.1
    assert takes[0].log_likelihood > takes[1].log_likelihood, "the calm take is the likeliest"
    hands, feet = (
        np.abs(takes[2].joints[:, j] - takes[0].joints[:, j]).mean() for j in ([20, 21], [7, 8])
    )
    assert feet > hands, "only the legs were drawn anew"
    assert np.abs(seen[20] - takes[0].joints[20]).max() < 0.05, "what is shown is the first take"


def test_influence_leads_a_hand_to_its_target_and_off_it(weights):
    controls = _walk()
    free = generate(Scene(), controls, weights)
    target = free.joints[:, 20] + [0.0, 0.25, 0.30]
    share = np.clip((np.arange(len(controls)) - 30) / 30.0, 0.0, 1.0)
    asked = generate(
        Scene(), replace(controls, mode="EE", hand_left=target, hand_left_influence=share), weights
    )
    whole = generate(Scene(), replace(controls, mode="EE", hand_left=target), weights)
    gap = np.linalg.norm(asked.joints[:, 20] - target, axis=-1)
    assert np.abs(asked.joints[:28] - free.joints[:28]).max() < 1e-3, "nothing before it begins"
    assert gap[:28].mean() > 3 * gap[80:].mean() and gap[20] > gap[45] > gap[70]
    assert np.abs(asked.joints[90:, 20] - whole.joints[90:, 20]).max() < 0.03
    none = generate(
        Scene(),
        replace(controls, mode="EE", hand_left=target, hand_left_influence=0 * share),
        weights,
    )
    assert np.abs(none.joints - free.joints).max() < 1e-3


def test_the_change_of_mode_is_blended_as_long_as_asked(weights):
    controls = _walk()
    free = generate(Scene(), controls, weights)
    modes = ["FREE"] * 60 + ["EE"] * (len(controls) - 60)
    asked = replace(controls, mode=modes, hand_left=free.joints[:, 20] + [0.0, 0.3, 0.4])
    takes = [generate(Scene(), replace(asked, blend=blend), weights) for blend in (0.0, 1 / 3, 0.8)]
    jump = [
        np.linalg.norm(np.diff(take.joints[55:85, 20], axis=0), axis=-1).max() for take in takes
    ]
    assert jump[0] > jump[1] > jump[2]
