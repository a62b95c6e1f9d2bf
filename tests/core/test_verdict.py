"""What an eye sees of a take is said, and what it does not see is not."""

import re
from dataclasses import replace

import numpy as np
import pytest

from dafnet_addon import Box, CleanUp, Controls, Scene, Take, generate, load_weights
from dafnet_addon.core.paths import Stop, route
from dafnet_addon.core.root import RootPath, root_from_matrices
from dafnet_addon.core.skeleton import FEET, JOINTS, REST
from dafnet_addon.core.softness import support_under
from dafnet_addon.core.storage import packed, unpacked
from dafnet_addon.core.take import Finding
from dafnet_addon.core.verdict import verdict

STOOL = Scene((Box([0.0, 0.0, 0.22], [0.22, 0.22, 0.22], name="Stool"),))
WAY = route(Stop((0.0, 1.6), np.pi, 0.3), Stop((0.0, 0.0), 0.0, 0.8, seated=True))
CONTROLS = Controls(30.0, WAY.path.matrices())


def _take() -> Take:
    return generate(STOOL, CONTROLS, load_weights(), clean_up=CleanUp(feet=1.0, seat=1.0))


def _said(joints: np.ndarray, scene: Scene = STOOL, scale: float = 1.0) -> list[Finding]:
    path, _ = root_from_matrices(CONTROLS.root)
    return list(verdict(joints, 30.0, path, scene, support_under(scene, path), scale=scale))


def test_who_sits_well_is_told_so_and_the_file_keeps_it() -> None:
    take = _take()
    assert [each.word for each in take.verdict] == ["sits"] and take.verdict[0].good
    assert "'Stool'" in take.verdict[0].text
    assert unpacked(packed(take, CONTROLS))[0].verdict == take.verdict
    bare = replace(take, verdict=(), touches=np.zeros((0, 4)))
    kept = unpacked(packed(bare, CONTROLS))[0]
    assert kept.verdict == () and kept.touches.shape == (0, 4)


def test_hovering_sinking_and_standing_are_told_apart() -> None:
    joints = _take().joints
    # The take rests within a centimetre of where the stool carries a body.
    words = ((0.09, "hovers (8|9|10) cm"), (-0.08, "sinks (7|8|9) cm"), (0.4, "stands"))
    for higher, word in words:
        found = [each for each in _said(joints + np.array([0.0, 0.0, higher])) if not each.good]
        assert any(re.fullmatch(word, each.word) for each in found), (higher, found)


def test_a_child_is_told_its_own_centimetres() -> None:
    higher = _take().joints + np.array([0.0, 0.0, 0.09])
    (said,) = [each for each in _said(higher, scale=0.7) if not each.good]
    amount = re.fullmatch("hovers (5|6|7) cm", said.word)
    assert amount and said.text.startswith(f"Hovers {amount[1]} cm over 'Stool'")

    def inside(scale: float) -> int:
        """Centimetres that somebody of a scale is said to be in a wall across the way."""
        root = CONTROLS.root.copy()
        root[:, :3, 3] *= scale
        center, half_size = scale * np.array([0.0, 0.8, 0.8]), scale * np.array([1.0, 0.2, 0.8])
        scene, controls = Scene((Box(center, half_size),)), Controls(30.0, root, scale=scale)
        said = " ".join(each.text for each in generate(scene, controls, load_weights()).verdict)
        found = re.search(r"is (\d+) cm inside", said)
        assert found is not None
        return int(found.group(1))

    assert inside(0.7) == pytest.approx(0.7 * inside(1.0), abs=1.0)


def test_what_is_gone_through_is_named_with_the_part_of_the_body() -> None:
    joints = _take().joints
    knees = joints[-1, [4, 5]].mean(axis=0)
    block = Box([knees[0], knees[1], 0.25], [0.3, 0.1, 0.2], name="Box")
    found = [each for each in _said(joints, Scene((*STOOL.solids, block))) if not each.good]
    assert found[0].word == "in Box" and "shin is" in found[0].text
    away = replace(block, center=[3.0, 0.0, 0.25])
    assert all(each.good for each in _said(joints, Scene((*STOOL.solids, away))))


def test_a_board_too_thin_to_be_deep_in_is_gone_through_all_the_same() -> None:
    joints = _take().joints.copy()
    joints[-60:] = joints[-20]  # who moves is not across a board for long
    neck = joints[-1, JOINTS.index("neck")] - (0.0, 0.0, 0.04)

    def said(thick: float, *, aside: float = 0.0, over: float = 0.0) -> list[str]:
        center = [neck[0] + aside, neck[1], neck[2] + over]
        board = Box(center, [0.4, 0.4, thick / 2], name="Board")
        found = _said(joints, Scene((*STOOL.solids, board)))
        return [each.text for each in found if "Board" in each.text]

    for thick in (0.02, 0.04):
        found = said(thick)
        assert found and all(
            re.match("The .* goes through 'Board' at .* move it", told) for told in found
        )
        assert any("trunk" in told or "head" in told for told in found), found
    assert not said(0.04, aside=0.9), "beside it"
    assert not said(0.04, over=0.5), "over the head"
    knee = joints[-1, JOINTS.index("left_knee")]
    table = Box([knee[0], knee[1], knee[2] + 0.12], [0.5, 0.15, 0.01], name="Board")
    found = _said(joints, Scene((*STOOL.solids, table)))
    assert not [each for each in found if "Board" in each.text], "legs are under it"


def test_a_foot_that_slides_is_named() -> None:
    joints = _take().joints.copy()
    last = joints[-30:]
    last[:, FEET[1], 0] += np.linspace(0.0, 0.1, 30)
    last[:, FEET[1], 2] = joints[-31, FEET[1], 2]
    (slides,) = [each for each in _said(joints) if each.word.startswith("slides")]
    assert slides.text.startswith("The right foot slides")


def test_a_foot_that_rolls_off_slowly_does_not_slide() -> None:
    fps, seconds = 24.0, np.arange(48) / 24.0
    path = RootPath(np.zeros((48, 3)), np.zeros(48))
    nothing = support_under(Scene(), path)

    def said(places: np.ndarray) -> set[str]:
        joints = np.repeat(REST[None], 48, axis=0)
        joints[:, FEET[0], 1] += places
        return {each.text[:20] for each in verdict(joints, fps, path, Scene(), nothing)}

    leaves = np.maximum(seconds - 1.2, 0.0)
    assert not said(0.5 * leaves**2), "it gathers speed, and is gone"
    assert "The left foot slides" in said(0.09 * np.minimum(seconds, 1.0))


def test_without_furniture_there_is_nothing_to_sit_on() -> None:
    take = generate(Scene(), CONTROLS, load_weights(), clean_up=CleanUp(feet=1.0))
    assert all("slides" in each.word for each in take.verdict)
