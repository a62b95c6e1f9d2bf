"""The paper's figures: one of them drawn small, and what it has to show."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.skeleton import SEAT_TO_PELVIS, joint
from dafnet_addon.core.weights import load_weights

Image = pytest.importorskip("PIL.Image")

from benchmarks.figures import draw  # noqa: E402
from benchmarks.figures.augmented import moved_to, typing  # noqa: E402
from benchmarks.figures.one_path import HEIGHTS, seated_at  # noqa: E402


def test_figure_11_is_drawn_and_its_mannequins_end_at_different_heights(
    blender: ModuleType, tmp_path: Path
) -> None:
    progress: list[float] = []
    files = draw(tmp_path / "new", None, {}, ["11"], progress.append, scale=0.25)
    assert [file.name for file in files] == ["figure_11.png"]
    assert progress == sorted(progress) and progress[-1] == 1.0
    with Image.open(files[0]) as picture:
        assert picture.width == 400
        pixels = np.asarray(picture.convert("RGB"), dtype=float)
    columns = np.array_split(pixels[: picture.height * 3 // 4], len(HEIGHTS), axis=1)
    assert all(column.std(axis=(0, 1)).max() > 10.0 for column in columns), (
        "there is somebody in every column"
    )

    chosen = HEIGHTS[::2]
    pelvis = np.array([motion.joints[-15, 0, 2] for motion in seated_at(load_weights(), chosen)])
    assert (np.diff(pelvis) > 0.05).all(), "higher seats, higher pelvises"
    assert np.abs(pelvis - chosen - SEAT_TO_PELVIS).max() < 0.08


def test_figure_9_moves_seat_and_desk_apart(blender: ModuleType, tmp_path: Path) -> None:
    files = draw(tmp_path, None, {}, ["9"], lambda _: None, scale=0.25)
    with Image.open(files[0]) as picture:
        pixels = np.asarray(picture.convert("RGB"), dtype=float)
    panels = np.array_split(pixels[: len(pixels) * 3 // 4], 4, axis=1)
    assert all(panel.std(axis=(0, 1)).max() > 10.0 for panel in panels)
    orange = [(panel[..., 0] > panel[..., 2] + 90).sum() for panel in panels]
    assert orange[0] > 3 * max(orange[1:]), "only the first is as the network made it"

    source = typing(load_weights(), 0.50, 0.80)
    for seat, desk in ((0.0, -0.04), (-0.08, 0.0), (-0.08, -0.04)):
        moved = moved_to(source, seat, desk) - source
        assert np.abs(moved[:, 0, 2] - seat).max() < 0.01
        assert np.abs(moved[:, [joint("left_wrist"), joint("right_wrist")], 2] - desk).max() < 0.01


def test_unknown_figures_are_refused_and_comparisons_without_others_left_out(
    blender: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(InputError, match="no figure 4"):
        draw(tmp_path, None, {}, ["4"], lambda _: None)
    assert draw(tmp_path, None, {}, ["15", "16"], lambda _: None) == []
    assert capsys.readouterr().err.count("\n") == 1
