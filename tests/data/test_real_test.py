"""The test among real furniture: who is in it, and that its frozen clips sit where their pieces
carry them.
"""

import json

import numpy as np
import pytest

from dafnet_addon.core.conditions import shot_steps
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.take import Controls
from dafnet_addon.data.dataset.splits import role_of_body, role_of_maker
from dafnet_addon.data.furnish.flesh import probes
from dafnet_addon.data.held_out.real import FROZEN_REAL, real_test
from kit.places import SHARED

FROZEN = json.loads(FROZEN_REAL.read_text(encoding="utf-8"))["clips"]


@pytest.mark.parametrize("role", ["choose", "tell"])
def test_who_chooses_and_who_tells_are_apart(role: str) -> None:
    clips = [clip for clip in FROZEN if clip["role"] == role]
    assert len(clips) > 20
    for clip in clips:
        assert (
            role_of_maker(clip["maker"]) == role
            and role_of_body(*clip["body"].split("/", 1)) == role
        )
        assert not clip["body"].startswith("ui_prmd"), "whose arms are made up"
    bodies = {clip["body"] for clip in clips}
    pieces = {row[0] for clip in clips for row in clip["rows"]}
    others = [clip for clip in FROZEN if clip["role"] != role]
    assert bodies.isdisjoint(clip["body"] for clip in others)
    assert pieces.isdisjoint(row[0] for clip in others for row in clip["rows"])


def test_what_two_makers_made_together_is_held_out_with_either() -> None:
    assert role_of_maker("Ann & Jay-Artist") == role_of_maker("Jay-Artist & Ann") == "choose"
    assert role_of_maker("Kator Legaz & Ann") == "tell"
    assert role_of_maker("Ann & Bob") == "train"


def test_pieces_are_at_their_true_size() -> None:
    for clip in FROZEN:
        assert all(abs(row[4] - 1.0) <= 0.05 for row in clip["rows"])
        assert abs(clip["rows"][0][4] - 1.0) < 1e-3, (
            "the one that carries the body is not stretched at all"
        )


@pytest.mark.furniture
@pytest.mark.mocap
@pytest.mark.parametrize("role", ["choose", "tell"])
def test_frozen_clips_sit_where_their_pieces_carry_them(role: str) -> None:
    clips = real_test(SHARED / "mocap", SHARED / "furniture" / "library", role)
    assert [clip.piece for clip in clips] == [
        frozen["piece"] for frozen in FROZEN if frozen["role"] == role
    ]
    seen = run_to_end(
        shot_steps(clips[0].scene, Controls(fps=30.0, root=clips[0].path.matrices()))
    ).conditions.occupancy
    assert seen[-1].max() > 0.9, "a generation sees the furniture"
    for clip, frozen in zip(clips, (f for f in FROZEN if f["role"] == role), strict=True):
        (rest,) = clip.rests
        assert (
            abs(np.median(clip.joints[rest.start : rest.end, 0, 2]) - frozen["pelvis"]) < 0.025
        ), clip.name
        used = clip.real.shapes[:1]
        under = clip.joints[rest.start : rest.end, 0] * (1, 1, 0)
        heights = np.arange(0.1, 1.0, 0.02)
        columns = np.concatenate([under + np.array([0.0, 0.0, z]) for z in heights])
        touches = clip.real.bank.distances(used, columns).reshape(len(heights), -1) < 0.02
        assert touches.any(0).mean() > 0.9, f"{clip.name}: nothing is under the pelvis"
        # Feet and head never cut what stands about.
        flesh = probes(clip.joints)
        assert (
            clip.real.bank.distances(clip.real.shapes[1:], flesh.reshape(-1, 3)).min(initial=1.0)
            > 0.0
        ), clip.name
