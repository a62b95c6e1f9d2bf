"""The test of who is sent to real seats: who is in it, and that each is asked what can be done."""

import json
from dataclasses import replace

import numpy as np
import pytest

from dafnet_addon.data.dataset.splits import role_of_maker
from dafnet_addon.data.held_out.walks import FROZEN_WALKS, real_walks
from kit.places import LIBRARY

FROZEN = json.loads(FROZEN_WALKS.read_text(encoding="utf-8"))["clips"]


@pytest.mark.parametrize("role", ["choose", "tell"])
def test_pieces_of_makers_that_never_train_from_two_to_three_metres(role: str) -> None:
    walks = [walk for walk in FROZEN if walk["role"] == role]
    assert len(walks) > 30 and len({walk["piece"] for walk in walks}) > 10
    for walk in walks:
        assert role_of_maker(walk["maker"]) == role
        assert 1.99 < np.linalg.norm(walk["place"]) < 3.01
    around = np.array([walk["place"] for walk in walks if walk["piece"] == walks[0]["piece"]])
    assert np.linalg.norm(around.mean(0)) < 1.0, "from all sides"


@pytest.mark.furniture
def test_they_come_to_rest_on_their_pieces_as_high_as_these_carry_them() -> None:
    walks = real_walks(LIBRARY, "choose")
    asked = [walk for walk in FROZEN if walk["role"] == "choose"]
    assert sum(walks.sent.values()) == len(asked)
    assert len(walks.clips) + sum(walks.refused.values()) == len(asked)
    for clip in walks.clips:
        (rest,) = clip.rests
        assert np.linalg.norm(clip.path.position[rest.start, :2] - rest.position[:2]) < 0.02
        assert abs(clip.joints[rest.start, 0, 2] - rest.position[2]) < 1e-6
        under = rest.position - np.array([[0.0, 0.0, z] for z in np.arange(0.0, 0.2, 0.01)])
        touches = clip.real.bank.distances(clip.real.shapes, under) < 0.02
        assert touches.any() and clip.path.position[rest.start, 2] == 0.0
        begun = np.linalg.norm(clip.path.position[0, :2])
        assert 1.99 < begun < 3.01


@pytest.mark.torch
@pytest.mark.furniture
def test_the_report_has_rows_of_those_that_are_sent() -> None:
    from dafnet_addon.core.weights import load_weights
    from dafnet_addon.training.evaluation.real_report import real_page, real_report, real_text

    walks = real_walks(LIBRARY, "choose")
    one = replace(walks, clips=walks.clips[:1], sent={walks.clips[0].kind: 2}, refused={})
    refused = replace(one, refused={walks.clips[0].kind: 1})
    report = real_report(load_weights(), [], seeds=1, walks=refused)
    rows = report["sent by the director"]
    assert set(rows) == {"free_t0", "free_t0_clean", "free_t1"}
    assert rows["free_t0"]["clips"] == 1 and rows["free_t0"]["refused"] == 0.5
    assert 0.0 <= rows["free_t0"]["sits_within_8cm"] <= 1.0 and "lean_degrees" in rows["free_t0"]
    assert "refused" in real_text(report)
    page = real_page(report, "Those that choose")
    row = next(line for line in page.splitlines() if line.startswith("| **all** |"))
    assert row.split(" | ")[1:3] == ["1", "50"], "one was sent, one of two refused"
    assert (
        real_report(load_weights(), [], seeds=1, walks=one)["sent by the director"]["free_t0"][
            "refused"
        ]
        == 0.0
    )
