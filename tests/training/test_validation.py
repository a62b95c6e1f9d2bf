"""A run's validation: the figures are those of ``dafnet evaluate``, the best weights are kept, the
run is only read; and a cooled copy of it.
"""

import json
import runpy
import shutil
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs torch")

from benchmarks import ablation  # noqa: E402
from dafnet_addon import cli  # noqa: E402
from dafnet_addon.core.errors import InputError  # noqa: E402
from dafnet_addon.core.root import raw_root_from_joints  # noqa: E402
from dafnet_addon.core.skeleton import REST, STATURE  # noqa: E402
from dafnet_addon.core.weights import load_weights  # noqa: E402
from dafnet_addon.data.furnish.boxes import box  # noqa: E402
from dafnet_addon.data.held_out.captured import HeldClip  # noqa: E402
from dafnet_addon.data.motion.rests import Rest  # noqa: E402
from dafnet_addon.training import candidates, validation  # noqa: E402
from dafnet_addon.training.config import TrainingConfig  # noqa: E402
from dafnet_addon.training.evaluation.clips import MeasuredClip, measure_takes  # noqa: E402
from dafnet_addon.training.evaluation.real_report import real_report  # noqa: E402
from dafnet_addon.training.parts import load_run  # noqa: E402
from dafnet_addon.training.train import train_part  # noqa: E402
from dafnet_addon.training.validation import held_out_losses, read_record, score, validate_steps  # noqa: E402
from kit.networks import TINY  # noqa: E402
from kit.places import ROOT  # noqa: E402

pytestmark = pytest.mark.torch


def _clip(name: str, maker: str = "maker", body: str = "no/body") -> HeldClip:
    """The rest pose, in its second half lowered onto a block of 0.45 m."""
    joints = np.tile(REST, (40, 1, 1))
    joints[20:, :, 2] -= REST[0, 2] - 0.57
    return HeldClip(
        name=name,
        body=body,
        activity="sit",
        unseen=True,
        composed=False,
        room="",
        joints=joints,
        path=raw_root_from_joints(joints),
        boxes=box((0.0, 0.0, 0.225), (0.4, 0.4, 0.45))[None],
        rests=(Rest(20, 40, joints[-1, 0], 0.0),),
        kind="chair",
        maker=maker,
    )


CLIPS = [_clip("one"), _clip("two", "other maker")]


def _train(dataset: Path, folder: Path, steps: int) -> None:
    """Train all parts up to a number of steps of sixty."""
    config = TrainingConfig(
        minutes_predictor=1e-9, steps_flow=60, batch=4, warmup=5, save_every=1000
    )
    if not (folder / "predictor.checkpoint").exists():
        train_part("predictor", dataset, folder, TINY, config)
    for part in ("upper", "lower"):
        train_part(part, dataset, folder, TINY, replace(config, steps_flow=steps))
        run = load_run(part, folder)
        run.config = config
        run.save()


@pytest.fixture
def described(dataset: Path) -> Path:
    (dataset / "dataset.json").write_text(
        '{"train": ["no/body"], "furniture": {}, "windows": 12, "seed": 3}', encoding="utf-8"
    )
    return dataset


def _files(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.glob("*.checkpoint")}


def test_a_run_is_measured_as_it_goes_on_and_its_best_weights_are_kept(
    described: Path, tmp_path: Path
):
    run = tmp_path / "run"
    _train(described, run, 2)
    before = _files(run)
    (first,) = validate_steps(run, described, CLIPS)
    assert _files(run) == before, "the run is only read"
    assert not list(validate_steps(run, described, CLIPS)), "nothing is measured twice"
    _train(described, run, 30)
    (second,) = validate_steps(run, described, CLIPS)

    shipped, *own = read_record(run)
    assert own == [first, second] and "hours" not in shipped
    assert [each["parts"]["upper"]["steps"] for each in own] == [2, 30]
    assert set(first["makers"]) == {"maker", "other maker"} and set(first["held_out"]) == {
        "upper",
        "lower",
    }
    assert second["held_out"]["lower"] < first["held_out"]["lower"], "it has learnt"
    assert "speed_quick" in second["figures"]["free_t1"], "slower bands need longer clips"
    assert "temperature 1: skate" in validation.describe(second)
    best = load_weights(run / validation.BEST)
    kept = json.loads(best.metadata["validation"])
    assert kept == min(own, key=lambda each: each["score"])
    assert (run / validation.CURVES).read_bytes().startswith(b"\x89PNG")

    report = real_report(best, CLIPS, seeds=1)["all seats"]
    for which in ("ground_truth", "free_t0", "ee_t0"):
        for name, value in kept["figures"][which].items():
            if name == "intervals":
                assert all(report[which][name][each] == value[each] for each in value)
            else:
                assert report[which][name] == value, "as 'dafnet evaluate' has it"


def test_only_what_is_better_takes_the_place_of_the_best(
    described: Path, tmp_path: Path, monkeypatch
):
    run = tmp_path / "run"
    scores = iter((9.0, 5.0, 7.0, 4.0))  # the first is of the weights that ship
    monkeypatch.setattr(validation, "score", lambda clips: next(scores))
    for steps, best in ((2, 5.0), (4, 5.0), (6, 4.0)):
        _train(described, run, steps)
        list(validate_steps(run, described, CLIPS))
        words = load_weights(run / validation.BEST).metadata
        assert json.loads(words["validation"])["score"] == best
    assert json.loads(words["training"])["upper"]["steps"] == 6


def test_it_goes_on_until_the_budget_is_spent(described: Path, tmp_path: Path, monkeypatch):
    run, slept = tmp_path / "run", []

    def sleep(seconds: float) -> None:
        slept.append(seconds)
        _train(described, run, (2, 2, 20, 60)[len(slept) - 1])

    monkeypatch.setattr(validation.time, "sleep", sleep)
    with pytest.raises(InputError, match="no weights of the whole flow yet"):
        list(validate_steps(run, described, CLIPS))
    rows = list(validate_steps(run, described, CLIPS, every=10.0))
    assert [each["parts"]["lower"]["steps"] for each in rows] == [2, 20, 60]
    assert len(slept) == 4 and all(500.0 < seconds <= 600.0 for seconds in slept)


def test_what_fails_leaves_all_as_it_was(described: Path, tmp_path: Path, monkeypatch):
    run = tmp_path / "run"
    _train(described, run, 2)
    list(validate_steps(run, described, CLIPS))
    _train(described, run, 4)
    names = (validation.RECORD, validation.BEST, validation.CURVES)
    before = [(run / name).read_bytes() for name in names]

    def fails(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(validation, "measure_clips", fails)
        with pytest.raises(KeyboardInterrupt):
            list(validate_steps(run, described, CLIPS))
    assert [(run / name).read_bytes() for name in names] == before
    assert len(list(validate_steps(run, described, CLIPS))) == 1, "and can be gone on with"
    (run / validation.RECORD).write_text('{"weights": ', encoding="utf-8")
    with pytest.raises(InputError, match=r"validation\.jsonl' is not JSON; restore"):
        list(validate_steps(run, described, CLIPS))


def test_a_row_says_how_lively_takes_are_beside_captured_motion():
    found = {"sits_within_4cm": 0.5, "sits_within_8cm": 0.75, "skate_cm": 0.02}
    targets = {**found, "end_effector_error": 0.01}
    real = {**found, "speed_slow": 0.04, "speed_middle": 0.10, "speed_quick": 0.05}
    free = {**found, "speed_slow": 0.03, "speed_middle": 0.12, "speed_quick": 0.05, "skate_cm": 0.4}
    row = {
        "weights": "the run",
        "score": 3.0,
        "figures": {
            "ground_truth": real,
            "free_t0": found,
            "free_t1": free,
            "ee_t0": targets,
            "ee_t1": {**targets, "end_effector_error": 0.02},
        },
    }
    assert validation.describe(row).endswith(
        "; temperature 1: skate 0.40, life slow / middle / quick 0.75 / 1.20 / 1.00 of real, "
        "EED 0.0200"
    )
    del row["figures"]["ee_t1"], free["speed_slow"]
    assert validation.describe(row).endswith("; temperature 1: skate 0.40"), "of an earlier version"


def test_a_score_is_how_far_calm_takes_are_off():
    def measured(clip: HeldClip, free: np.ndarray, ee: np.ndarray) -> MeasuredClip:
        takes = {"ground_truth": clip.joints, "free_t0": free, "ee_t0": ee}
        return MeasuredClip(
            clip, {name: measure_takes(clip, take[None]) for name, take in takes.items()}
        )

    one, two, three = _clip("one"), _clip("two"), _clip("three", "other maker")
    true = [measured(clip, clip.joints, clip.joints) for clip in (one, two, three)]
    assert score(true) == 0.0
    high = three.joints + np.array([0.0, 0.0, 0.06])
    off = measured(three, high, three.joints)
    assert abs(score([*true[:2], off]) - 3.0) < 0.01, "a maker counts as much as another"
    aside = three.joints + np.array([0.0, 0.02, 0.0])
    assert abs(score([measured(three, three.joints, aside)]) - 2.0 / 1.7 * STATURE) < 0.01
    sliding = three.joints.copy()
    sliding[20:, :, 1] += 0.01 * np.arange(20)[:, None]
    assert score([measured(three, sliding, three.joints)]) > 3.0


def test_likelihoods_are_of_the_averaged_weights(described: Path, tmp_path: Path):
    run = tmp_path / "run"
    _train(described, run, 12)
    averaged = held_out_losses(run, described)
    for part in ("predictor", "upper", "lower"):
        kept = load_run(part, run)
        kept.adopt_average()
        kept.save()
    assert held_out_losses(run, described) == averaged == held_out_losses(run, described)


def test_a_snapshot_is_whole_while_the_run_is_saved(described: Path, tmp_path: Path):
    run = tmp_path / "run"
    _train(described, run, 2)
    training, done = load_run("upper", run), threading.Event()

    def save() -> None:
        while not done.is_set():
            training.step += 1
            training.save()

    saving = threading.Thread(target=save)
    saving.start()
    try:
        steps = []
        for _ in range(20):
            with candidates.snapshot(run) as copy:
                steps.append(load_run("upper", copy).step)
                assert steps[-1] == load_run("upper", copy).step
            assert not copy.exists()
    finally:
        done.set()
        saving.join()
    assert steps == sorted(steps) and steps[-1] > steps[0]


def test_a_copy_is_cooled_and_the_run_is_not_disturbed(described: Path, tmp_path: Path):
    run, out = tmp_path / "run", tmp_path / "candidate"
    with pytest.raises(InputError, match="no weights of the whole flow yet"):
        candidates.cool(run, described, out, 0.02)
    _train(described, run, 4)
    for part, seconds in (("upper", 600.0), ("lower", 540.0)):
        kept = load_run(part, run)
        kept.seconds = seconds
        kept.save()
    before = _files(run)
    candidates._begin_cooling(run, out, 1.0)
    for part in ("upper", "lower"):
        begun = load_run(part, out)
        assert begun.step == 4 and begun.config.minutes_flow == 11.0
        rates = [
            begun.config.rate(1000, begun.config.share(1000, seconds))
            for seconds in (600.0, 630.0, 660.0)
        ]
        middle = (begun.config.peak + begun.config.final) / 2
        assert np.allclose(rates, [begun.config.peak, middle, begun.config.final])
        # All but a second of it is over: what is left is trained by the command.
        begun.seconds = 659.0
        begun.save()
    file = candidates.cool(run, described, out, 1.0)
    assert _files(run) == before and file == out / "dafnet.safetensors"
    for part in ("upper", "lower"):
        assert load_run(part, out).step > 4 and load_run(part, out).share == 1.0
    said = json.loads(load_weights(file).metadata["training"])
    assert said["upper"]["minutes"] >= 11.0 and said["settings"]["cool_down"] == 1.0 / 11.0
    steps = load_run("upper", out).step
    candidates.cool(run, described, out, 1.0)
    assert load_run("upper", out).step == steps, "what is cooled stays so"


def test_the_mean_of_two_runs_says_of_which(described: Path, tmp_path: Path):
    early, late, file = tmp_path / "early", tmp_path / "late", tmp_path / "mean.safetensors"
    _train(described, early, 4)
    shutil.copytree(early, late)
    _train(described, late, 8)
    mean_weights = runpy.run_path(str(ROOT / "scripts" / "mean_of_runs.py"))["mean_weights"]
    mean_weights([early, late], described, file)
    for run in (early, late):
        candidates.write_weights(run, described, run / "own.safetensors")
    made, first, second = (
        load_weights(each) for each in (file, early / "own.safetensors", late / "own.safetensors")
    )
    name = max((each for each in made.tensors if ".lower." in f".{each}"), key=len)
    mean = 0.5 * (first.tensors[name] + second.tensors[name])
    span = np.abs(mean).max() / 64.0  # of eight bits
    np.testing.assert_allclose(made.tensors[name], mean, atol=span)
    assert not np.allclose(first.tensors[name], second.tensors[name], atol=1e-6)
    said = json.loads(made.metadata["training"])
    assert [each["upper"]["steps"] for each in said["mean_of"]] == [4, 8]
    assert said["lower"]["steps"] == 8

    other = load_run("predictor", late)
    with torch.no_grad():
        next(other.network.parameters()).add_(1.0)
    other.averaged = {}
    other.save()
    with pytest.raises(InputError, match="runs of one training"):
        mean_weights([early, late], described, tmp_path / "none.safetensors")
    assert not (tmp_path / "none.safetensors").exists()


def test_a_run_that_cools_itself_is_cooled_from_before(described: Path, tmp_path: Path):
    run = tmp_path / "run"
    _train(described, run, 60)  # its rate has fallen since step 42
    shutil.copyfile(run / "upper-held.checkpoint", run / "predictor-held.checkpoint")
    candidates._begin_cooling(run, tmp_path / "candidate", 1.0)
    for name, value in load_run("predictor", run).averaged.items():
        assert torch.equal(value, load_run("predictor", tmp_path / "candidate").averaged[name]), (
            "the flow has learnt with the predictor as it was done"
        )
    held = load_run("upper", run, name="upper-held").step
    assert 42 <= held < 60 and load_run("upper", tmp_path / "candidate").step == held
    other = tmp_path / "other"
    other.mkdir()
    (other / "mine.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="something else"):
        candidates.cool(run, described, other, 1.0)
    assert [file.name for file in other.iterdir()] == ["mine.txt"]


def test_the_commands(described: Path, tmp_path: Path, monkeypatch, capsys):
    from dafnet_addon.data.held_out import real as real_test

    monkeypatch.setattr(real_test, "real_test", lambda *_: CLIPS)
    run = tmp_path / "run"
    command = ["validate", str(run), str(described), "mocap", "--furniture", "library"]
    assert cli.main(command) == 1
    assert "no weights of the whole flow yet" in capsys.readouterr().err
    assert not run.exists()
    _train(described, run, 60)
    assert cli.main([*command, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [each["weights"] for each in found] == ["the weights that ship", "the run"]
    assert cli.main([*command, "--every", "60"]) == 0, "its budget is spent"
    assert capsys.readouterr().out.count("score") == 2
    cooled = ["cool", str(run), str(described), "-o", str(tmp_path / "out"), "--minutes", "0.01"]
    assert cli.main(cooled) == 0
    assert load_weights(tmp_path / "out" / "dafnet.safetensors").config["model"]["width"] == 16


def test_what_real_pieces_give_is_measured_in_equal_time(
    described: Path, tmp_path: Path, monkeypatch
):
    asked = []

    def prepare(folder: Path, out: Path, windows: int, processes: int, seed: int) -> None:
        asked.append((windows, seed))
        shutil.copytree(described, out, dirs_exist_ok=True)

    monkeypatch.setattr(ablation, "prepare", prepare)
    monkeypatch.setattr(ablation, "real_test", lambda *_: CLIPS)
    run = tmp_path / "run"
    _train(described, run, 2)
    candidates.write_weights(run, described, tmp_path / "w.safetensors")
    arguments = described, tmp_path, tmp_path, tmp_path / "out", 0.01
    weights = load_weights(tmp_path / "w.safetensors")
    text = ablation.furniture(*arguments, weights)
    assert asked == [(12, 3)], "as many windows, the same seed"
    lines = text.splitlines()[2:]
    groups = 1 + 1 + 2 + 1  # all; a body; two makers; a kind
    assert len(lines) == 3 * groups and all(line.count("|") == 11 for line in lines)
    kept = json.loads((tmp_path / "out" / "furniture.json").read_text(encoding="utf-8"))
    steps = kept[ablation.REAL]["steps"]
    assert min(steps.values()) > 0 and set(kept) == {ablation.BEGUN, ablation.BOXES, ablation.REAL}
    assert ablation.furniture(*arguments, weights) == text, "what is finished is kept"
    (described / "dataset.json").write_text('{"windows": 12, "seed": 3}', encoding="utf-8")
    with pytest.raises(InputError, match="no real pieces"):
        ablation.furniture(*arguments, weights)


def test_differences_are_paired():
    rng = np.random.default_rng(0)
    worse = rng.uniform(0.0, 30.0, 30)
    mean, low, high = ablation.paired_difference(worse - 2.0, worse)
    assert mean == pytest.approx(-2.0) and low == pytest.approx(-2.0) == pytest.approx(high)
    mean, low, high = ablation.paired_difference(worse - rng.normal(2.0, 1.0, 30), worse)
    assert low < mean < high and high - low < 1.5
