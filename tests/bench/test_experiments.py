"""The paper's comparisons, small: every system trains, is measured on the same clips, and lands in
the tables.
"""

import itertools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="the comparisons need torch")

from benchmarks import experiments, speed  # noqa: E402
from dafnet_addon.baselines.samp import SampConfig  # noqa: E402
from dafnet_addon.core.root import raw_root_from_joints  # noqa: E402
from dafnet_addon.core.skeleton import REST  # noqa: E402
from dafnet_addon.data.furnish.boxes import box  # noqa: E402
from dafnet_addon.data.held_out.captured import HeldClip  # noqa: E402
from dafnet_addon.data.motion.rests import Rest  # noqa: E402
from dafnet_addon.training.config import TrainingConfig  # noqa: E402
from dafnet_addon.training.parts import load_run  # noqa: E402
from kit.networks import TINY  # noqa: E402

pytestmark = pytest.mark.torch

TINY_SAMP = SampConfig(width=16, code=8, experts=2, latent=4, frames=10)


def _clip(name: str) -> HeldClip:
    """The rest pose, in its second half lowered onto a block of 0.45 m."""
    joints = np.tile(REST, (40, 1, 1))
    joints[20:, :, 2] -= REST[0, 2] - 0.57
    rest = Rest(20, 40, joints[-1, 0], 0.0)
    block = box((0.0, 0.0, 0.225), (0.4, 0.4, 0.45))[None]
    return HeldClip(
        name, "no/body", "sit", True, True, "", joints, raw_root_from_joints(joints), block, (rest,)
    )


def test_all_systems_train_and_land_in_the_tables(
    dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setitem(experiments.FLOWS["MoGlow"], "steps_whole", 3)
    training = TrainingConfig(batch=4, minutes_predictor=0.005, warmup=2)
    arguments = dataset, tmp_path, 0.02, 1, TINY, training, TINY_SAMP
    experiments.train(*arguments)
    steps = load_run("whole", tmp_path / "equal_time" / "moglow").step
    for part, folder in (("whole", "ap-p"), ("upper", "dafnet"), ("lower", "dafnet")):
        assert load_run(part, tmp_path / "equal_steps" / folder).step == steps
        assert load_run(part, tmp_path / "equal_time" / folder).seconds >= 60 * 0.02 / (
            1 if part == "whole" else 2
        )
    before = (tmp_path / "equal_time" / "ap-p" / "whole.checkpoint").read_bytes()
    experiments.train(*arguments)
    assert (tmp_path / "equal_time" / "ap-p" / "whole.checkpoint").read_bytes() == before, (
        "what is finished is kept"
    )

    clips = {"made up": [_clip("a")]}
    for table, systems in (
        (
            "table1",
            [
                "SAMP, equal time",
                "SAMP-A, equal time",
                "SAMP on our input, equal time",
                "DAFNet, equal time",
            ],
        ),
        (
            "table2",
            [
                *(
                    f"{name}, equal time"
                    for name in ("MoGlow", "AP-P", "DAFNet", "Lower body first")
                ),
                *(f"{name}, equal steps" for name in ("MoGlow", "AP-P", "DAFNet")),
                *(f"{name}, triple time" for name in ("AP-P", "DAFNet")),
            ],
        ),
    ):
        found = experiments.measure(table, clips, tmp_path, tmp_path)
        assert list(found) == [*systems, f"DAFNet, {experiments.SHIPPED}"]
        text = (tmp_path / f"{table}.md").read_text(encoding="utf-8")
        sections = text.split("### ")[1:]
        assert len(sections) == 2, "temperature 0 and 1"
        for section in sections:
            lines = section.splitlines()
            assert lines[4].startswith("| **ground truth**"), "the real motion comes first"
            assert [line.split(" | ")[0].strip("| ") for line in lines[5:] if line] == list(found)
        again = json.loads((tmp_path / f"{table}.json").read_text(encoding="utf-8"))
        assert again == json.loads(json.dumps(found))
        truth = found[systems[0]]["groups"]["made up"]["ground_truth"]
        assert (
            truth["clips"] == 1
            and truth["sits_within_6cm"] == 1.0
            and truth["foot_sliding_per_frame"] < 0.2
        )
    rows = experiments.compare_pairs(clips, tmp_path, tmp_path, draws=20).splitlines()[2:]
    assert [row.split(" | ")[0].strip("| ") for row in rows] == list(experiments.BUDGETS)
    of_one, kept = (
        json.loads((tmp_path / f"{name}.json").read_text(encoding="utf-8"))
        for name in ("paired", "table2")
    )
    total, weight = of_one["AP-P, equal time"][0]["ee_t0"]["end_effector_error"]
    there = kept["AP-P, equal time"]["groups"]["made up"]["ee_t0"]["end_effector_error"]
    assert total / weight == pytest.approx(there, abs=1e-4)


def test_ratios_stand_beside_the_papers():
    def values(slides: float) -> dict[str, object]:
        run: dict[str, object] = {"clips": 1, "seat_episodes": 0, "foot_sliding_per_frame": slides}
        run["intervals"] = {"foot_sliding_per_frame": [0.0, 1.0]}
        return {
            "steps": "7",
            "groups": {
                "g": dict.fromkeys(("ground_truth", "free_t0", "ee_t0", "free_t1", "ee_t1"), run)
            },
        }

    text = experiments.markdown(
        "table2", {"MoGlow, equal time": values(0.6), "DAFNet, equal time": values(0.2)}
    )
    row = next(line for line in text.splitlines() if line.startswith("| MoGlow"))
    assert "0.6 (0 to 1), ×3.00 [×2.17]" in row, "5495 / 2528 is the paper's ratio"
    assert "×" not in next(line for line in text.splitlines() if line.startswith("| DAFNet"))


def test_speed_of_every_system_beside_the_memory(monkeypatch: pytest.MonkeyPatch):
    clock = itertools.count()
    # whatever is timed takes a second
    monkeypatch.setattr(speed, "perf_counter", lambda: float(next(clock)))
    small = replace(TINY, width=32)
    report, text = speed.measure(None, lambda share: None, small, 4, TINY_SAMP)
    each = [name for name in ("DAFNet", "AP-P", "MoGlow") for _ in range(2)]
    assert [row["system"] for row in report["rows"]] == [*each, "SAMP", "DAFNet, these weights"]
    for row in report["rows"]:
        fewer = 4 if row["system"] == "SAMP" else 2
        assert row["ms_1"] == 1000 / 4 and row["ms_64"] == round(1000 / (fewer * 64), 3), (
            "milliseconds a pose"
        )
    sizes = {row["system"]: row["megabytes"] for row in report["rows"]}
    assert sizes["MoGlow"] > 2 * sizes["DAFNet"]
    assert "GB a second" in text
