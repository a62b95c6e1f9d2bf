"""Furniture out of reach is not measured, and takes are what they were."""

import numpy as np
import pytest

from dafnet_addon import Box, CleanUp, Controls, Mesh, Scene, generate, load_weights
from dafnet_addon.core import conditions, distance
from dafnet_addon.core.nearby import bounds, extent, solids_near
from dafnet_addon.core.paths import Stop, route
from dafnet_addon.core.rotations import yaw_matrix
from dafnet_addon.core.solids import BOX_CORNERS, BOX_TRIANGLES


def cube(place: tuple[float, float, float], half: float = 0.3, name: str = "cube") -> Mesh:
    matrix = np.eye(4)
    matrix[:3, 3] = place
    return Mesh(half * BOX_CORNERS, BOX_TRIANGLES, matrix, name)


def names(scene: Scene) -> list[str]:
    return [solid.name for solid in scene.solids]


def test_what_comes_near_is_found_and_nothing_else() -> None:
    places = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    solids = [
        cube((0.0, 1.2, 0.3), name="near"),
        cube((0.0, 1.4, 0.3), name="far"),
        cube((0.0, 0.0, 3.4), name="above"),
        cube((0.0, 0.0, 2.8), name="overhead"),
        Box(np.array([1.5, 0.0, 0.5]), np.full(3, 0.2), name="box"),
        Mesh(np.zeros((0, 3)), np.zeros((0, 3), int), name="empty"),
    ]
    assert names(solids_near(Scene(solids), places, 1.0)) == ["near", "overhead", "box"]
    twice = [cube(tuple(2.0 * s.matrix[:3, 3]), 0.6, s.name) for s in solids[:4]]
    assert names(solids_near(Scene(twice), 2.0 * places, 1.0, 2.0)) == ["near", "overhead"]
    assert solids_near(Scene(), places, 1.0).solids == ()


def test_what_moves_is_near_only_while_the_body_is_there() -> None:
    t = np.linspace(0.0, 10.0, 50)
    path = np.c_[t, np.zeros((50, 2))]
    along, against = np.tile(np.eye(4), (2, 50, 1, 1))
    along[:, :2, 3] = np.c_[t, np.full(50, 1.0)]
    against[:, :2, 3] = np.c_[t, np.where(t < 5.0, 1.0, 9.0)]
    apart = along.copy()
    apart[:, 0, 3] = t[::-1]
    apart[:, 1, 3] = np.where(np.abs(t - 5.0) < 2.0, 5.0, 0.0)
    scene = Scene(
        [
            Mesh(0.3 * BOX_CORNERS, BOX_TRIANGLES, m, n)
            for m, n in ((along, "along"), (against, "against"), (apart, "apart"))
        ]
    )
    assert names(solids_near(scene, path, 1.0)) == ["along", "against"]
    box = Box(apart[:, :3, 3], np.full(3, 0.3), np.tile(np.eye(3), (50, 1, 1)), "box")
    assert solids_near(Scene([box]), path, 1.0).solids == ()


def test_boxes_hold_their_solids() -> None:
    random = np.random.default_rng(0)
    for _ in range(20):
        matrix = np.eye(4)
        matrix[:3] += 0.5 * random.normal(size=(3, 4))
        mesh = Mesh(random.normal(size=(30, 3)), np.arange(30).reshape(10, 3), matrix)
        world = mesh.vertices @ mesh.matrix[:3, :3].T + mesh.matrix[:3, 3]
        low, high = bounds(mesh)
        assert (world >= low - 1e-9).all() and (world <= high + 1e-9).all()
    low, high = bounds(Box(np.zeros(3), np.array([1.0, 0.0, 0.0]), yaw_matrix(np.array(np.pi / 2))))
    assert np.allclose(high - low, [0.0, 2.0, 0.0], atol=1e-12)
    assert (
        extent([cube((0.0, 0.0, 0.0)), cube((5.0, 0.0, 0.0))]) == pytest.approx(5.6)
        and extent([]) == 0.0
    )


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1.0, 0.8])
def test_takes_are_the_same_to_the_last_bit_and_far_grids_are_not_built(
    monkeypatch, scale: float
) -> None:
    seat = Mesh(
        np.array([0.22, 0.22, 0.225]) * BOX_CORNERS + [0.0, 0.0, 0.225], BOX_TRIANGLES, name="seat"
    )
    random = np.random.default_rng(1)
    crowd = [
        cube((*(random.uniform(-12.0, 12.0, 2)), 0.3), random.uniform(0.05, 0.3), f"cube {k}")
        for k in range(120)
    ]
    crowd = [each for each in crowd if np.linalg.norm(each.matrix[:2, 3]) > 1.2]
    walked = route(Stop((2.5, 1.0), 1.5, 0.3), Stop((0.0, 0.0), 0.0, 1.0, seated=True))
    matrices = walked.path.matrices()
    matrices[:, :3, 3] *= scale
    controls = Controls(
        30.0, matrices, "EE", hand_left=np.tile([0.3, 0.3, 1.0], (len(matrices), 1)), scale=scale
    )
    clean, weights = CleanUp(1.0, 1.0, 1.0, 1.0, 0.5), load_weights()
    built: list[str] = []
    real = distance.grid_of.steps

    def counted(mesh: Mesh, floor: float):
        built.append(mesh.name)
        return (yield from real(mesh, floor))

    monkeypatch.setattr(distance.grid_of, "steps", counted)
    scene = Scene((seat, *crowd))
    take = generate(scene, controls, weights, clean_up=clean)
    few = len(set(built))
    monkeypatch.setattr(conditions, "solids_near", lambda scene, *_: scene)
    everything = generate(scene, controls, weights, clean_up=clean)
    assert np.array_equal(take.joints, everything.joints) and np.array_equal(
        take.rotations, everything.rotations
    )
    assert take.metrics == everything.metrics and take.raw_metrics == everything.raw_metrics
    assert 1 < few < 0.3 * len(set(built))
