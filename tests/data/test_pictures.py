"""Pictures of furniture with bodies: near before far, shaded, and what is hidden shines through."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from dafnet_addon.core.skeleton import REST
from dafnet_addon.data.dataset.fit_sheet import fit_sheet
from dafnet_addon.data.dataset.picture import body_of, picture
from dafnet_addon.data.furnish.flesh import Furnishing
from dafnet_addon.data.furnish.library import Piece
from dafnet_addon.data.furnish.shapes import bank_of
from dafnet_addon.data.motion.motion import motion_of

FROM_THE_FRONT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
CUBE = np.array([[0.0, 0.0, 0.5, 0.3, 0.3, 0.5, 0.0]])


def _seen(room: Furnishing, body: bool = False, away: float = 0.0) -> np.ndarray:
    pose = REST + np.array([0.0, away, 0.95 - REST[0, 2]])
    return picture(
        room,
        body_of(pose) if body else None,
        FROM_THE_FRONT,
        np.array([0.0, 0.0, 0.5]),
        (120, 160),
        80,
    ).astype(float)


def test_a_box_and_a_real_piece_of_its_size_look_alike() -> None:

    mesh = trimesh.creation.box((0.6, 0.6, 1.0))
    mesh.apply_translation((0.0, 0.0, 0.5))
    piece = Piece(
        name="cube",
        kind="shelf",
        title="cube",
        maker="anna",
        source="made",
        licence="CC0-1.0",
        vertices=np.asarray(mesh.vertices, float),
        triangles=np.asarray(mesh.faces, np.int64),
    )
    bank = bank_of([piece])
    box = _seen(Furnishing(boxes=CUBE))
    shape = _seen(Furnishing(shapes=np.array([[0, 0.0, 0.0, 0.0, 1.0]]), bank=bank))
    inside = (slice(50, 110), slice(45, 75))
    assert np.abs(box - shape)[inside].max() < 8
    drawn = (shape < 240).any(-1)
    assert abs(drawn.sum() / (box < 240).any(-1).sum() - 1.0) < 0.12


def test_furniture_hides_who_is_behind_it_and_lets_them_shine_through() -> None:
    room = Furnishing(boxes=CUBE)
    bare, before, behind = _seen(room), _seen(room, True, -1.0), _seen(room, True, 1.0)
    changed = [np.abs(picture - bare).max(-1) for picture in (before, behind)]
    body = changed[0] > 30
    inside = np.zeros_like(body)
    inside[45:115, 40:80] = True
    assert (body & inside).sum() > 200
    there = changed[1][body & inside]
    assert 3 < np.median(there) < 0.5 * np.median(changed[0][body & inside])
    beside = body & ~inside & (changed[1] > 30)
    assert beside.sum() > 0.5 * (body & ~inside).sum(), "nothing hides what is beside it"


def test_a_sheet_shows_every_kind_that_carries_a_body(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")

    from dafnet_addon.core.skeleton import joint
    from dafnet_addon.data.motion.retarget import at_seat_height

    seated = REST.copy()
    seated += np.array([0.0, 0.0, 0.58 - REST[0, 2]])
    for side in ("left", "right"):
        hip = seated[joint(f"{side}_hip")]
        thigh = np.linalg.norm(REST[joint(f"{side}_knee")] - REST[joint(f"{side}_hip")])
        shin = np.linalg.norm(REST[joint(f"{side}_ankle")] - REST[joint(f"{side}_knee")])
        foot = REST[joint(f"{side}_foot")] - REST[joint(f"{side}_ankle")]
        seated[joint(f"{side}_knee")] = hip + np.array([0.0, thigh, 0.0])
        seated[joint(f"{side}_ankle")] = seated[joint(f"{side}_knee")] - (0.0, 0.0, shin)
        seated[joint(f"{side}_foot")] = seated[joint(f"{side}_ankle")] + foot
    motion = motion_of("sits", "made", "one", "sit-stand", np.repeat(seated[None], 120, axis=0))
    assert motion.rests and at_seat_height(motion.joints, 0.58, 0.6).shape == motion.joints.shape
    mesh = trimesh.creation.box((0.4, 0.4, 0.45))
    mesh.apply_translation((0.0, 0.0, 0.225))
    stool = Piece(
        name="block",
        kind="stool",
        title="block",
        maker="anna",
        source="made",
        licence="CC0-1.0",
        vertices=np.asarray(mesh.vertices, float),
        triangles=np.asarray(mesh.faces, np.int64),
    )
    draws = {"sit": (np.array([[0, 60]]), np.ones(1))}
    file = tmp_path / "furniture.png"
    fit_sheet(file, [motion], draws, np.random.default_rng(0), bank_of([stool], (0.9, 1.0, 1.1)))
    drawn = image.open(file)
    rows = drawn.height // 170
    assert drawn.width == 1400 and rows == 2, "the stool's row, and that of boxes"
    first = np.asarray(drawn.convert("RGB"))[14:170, :140]
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 8
