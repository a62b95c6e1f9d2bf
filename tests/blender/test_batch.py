"""Lists of shots are made by ``populate`` itself, in processes with Blender."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType

import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline.contents import key_hashes
from bl_ext.user_default.dafnet.dafnet_addon.blender.showcase.small_room import save_small_room
from bl_ext.user_default.dafnet.dafnet_addon.blender.showcase.thumbnails import thumbnail

from dafnet_addon.core.manifest import read_manifest
from kit.places import ROOT

_LIST = """
[defaults]
room = "small.blend"
takes = 2
seconds = 1
people = [{ tasks = [{ sit_on = "Chair", seconds = 1 }] }]
[[shots]]
name = "scene"
count = 2
[[shots]]
name = "crowded"
people = [{ count = 3, tasks = [{ sit_on = "Chair", seconds = 1 }] }]
"""


@pytest.fixture
def jobs(blender: ModuleType, tmp_path: Path) -> Path:
    """Three shots of a room with one chair, one of them of three people."""
    if blender.app.binary_path:
        pytest.skip("runs Blender's Python module in processes of its own")
    save_small_room(tmp_path / "small.blend")
    file = tmp_path / "jobs.toml"
    file.write_text(_LIST, encoding="utf-8")
    return file


def started(*arguments: object) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-m", "dafnet_addon", "batch", *map(str, arguments)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.slow
def test_shots_are_made_by_populate(jobs: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = started(jobs, "-o", out, "--workers", 2)
    _, err = process.communicate()
    told = json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert process.returncode == 1 and told["counts"] == {"made": 2, "failed": 1}, err
    crowded = told["shots"][0]
    assert crowded["name"] == "crowded" and "Chair" in crowded["sentence"], "one seat for three"
    assert crowded["sentence"] in err and not (out / "crowded").exists()

    first = read_manifest(out / "scene_001")
    assert first is not None and first.takes == 2 and len(first.content) == 2
    assert [Path(each).name for each in first.inputs] == ["small.blend"]
    before = {name: key_hashes(out / name / "scene.blend") for name in ("scene_001", "scene_002")}
    second = read_manifest(out / "scene_002")
    assert second is not None
    assert len({*first.content.values(), *second.content.values()}) == 4, "no two takes are alike"

    process = started(jobs, "-o", out, "--only", "scene_*")
    process.communicate()
    assert process.returncode == 0
    (out / "scene_002" / "shot.json").write_text("{}", encoding="utf-8")
    process = started(jobs, "-o", tmp_path / "again", "--only", "scene_002", "--json")
    said, err = process.communicate()
    assert json.loads(said)["counts"] == {"made": 1}, err
    assert key_hashes(tmp_path / "again" / "scene_002" / "scene.blend") == before["scene_002"]


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_batch_that_is_stopped_leaves_nothing_half_done(
    jobs: Path, tmp_path: Path, number: int
) -> None:
    out = tmp_path / "out"
    process = started(jobs, "-o", out, "--workers", 1, "--only", "scene_*")
    until = time.monotonic() + 60
    while not (out / "logs" / "scene_001.log").exists():
        assert time.monotonic() < until
        time.sleep(0.05)
    time.sleep(1.0)
    process.send_signal(number)
    _, err = process.communicate()
    assert process.returncode == 128 + number and err.strip().splitlines()[-1] == "dafnet: stopped."
    left = {each.name for each in out.iterdir()} - {"logs", "batch.json"}
    assert all(read_manifest(out / name) for name in left), left
    process = started(jobs, "-o", out, "--only", "scene_*", "--json")
    said, err = process.communicate()
    assert process.returncode == 0, err
    assert {row["name"] for row in json.loads(said)["shots"]} == {"scene_001", "scene_002"}


def test_a_thumbnail(blender: ModuleType, tmp_path: Path) -> None:
    image = blender.data.images.new("frame", 640, 360)
    image.filepath_raw, image.file_format = str(tmp_path / "frame.png"), "PNG"
    image.save()
    blender.data.images.remove(image)
    small = thumbnail(tmp_path / "frame.png")
    assert small[:3] == b"\xff\xd8\xff" and len(small) < 20_000
    file = tmp_path / "small.jpg"
    file.write_bytes(small)
    assert tuple(blender.data.images.load(str(file)).size) == (240, 135)
    (tmp_path / "bad.png").write_bytes(b"no picture")
    for bad in ("bad.png", "none.png"):
        with pytest.raises(Exception, match="is not a picture"):
            thumbnail(tmp_path / bad)


@pytest.mark.slow
def test_the_python_on_the_page(tmp_path: Path, blender: ModuleType) -> None:
    if blender.app.binary_path:
        pytest.skip("runs Blender's Python module in processes of its own")
    page = (ROOT / "docs" / "batch.md").read_text(encoding="utf-8")
    code = page.split("```python\n")[1].split("```")[0]
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert sorted(line.split()[:2] for line in done.stdout.splitlines()) == [
        ["cafe_0", "made"],
        ["cafe_1", "made"],
    ], done.stderr
    assert read_manifest(tmp_path / "out" / "shots" / "cafe_1")


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self").exists(), reason="looks processes up in /proc")
def test_killed_batches_are_measured(tmp_path: Path, blender: ModuleType) -> None:
    """A small version of what ``dafnet bench scale`` does with a hundred scenes."""
    if blender.app.binary_path:
        pytest.skip("runs Blender's Python module in processes of its own")
    command = [sys.executable, "-m", "dafnet_addon", "bench", "scale", "--only", "kills"]
    small = ["--scenes", "4", "--takes", "2", "--frames", "15", "--kills", "3", "--rounds", "1"]
    done = subprocess.run(
        [*command, *small, "-o", str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    (row,) = json.loads((tmp_path / "scale.json").read_text(encoding="utf-8"))
    assert row["holds"] and "8 takes, the same" in row["measured"], row
    assert "| yes |" in done.stdout
