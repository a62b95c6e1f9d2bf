"""The command as a process: signals, streams, what is not installed, several at once, files that
are odd.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from bl_ext.user_default.dafnet.dafnet_addon import cli
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.armature import create_character
from bl_ext.user_default.dafnet.dafnet_addon.blender.showcase.preview import render_film

from dafnet_addon.cli import main
from kit.messages import without_blenders
from kit.places import ROOT

_RUN = "import sys; sys.argv[0] = 'dafnet'; from dafnet_addon.cli import run; run()"


@pytest.fixture(autouse=True)
def _module_of_its_own(blender: ModuleType) -> None:
    if blender.app.binary_path:
        pytest.skip("runs Blender's Python module in processes of its own")


@pytest.fixture
def scene(blender: ModuleType, tmp_path: Path) -> Path:
    """A file whose character, of a Japanese name, walks a metre in 20 frames."""
    blender.context.scene.frame_end = 20
    armature = create_character(blender.context, "花子")
    for frame, y in ((1, 0.0), (20, 1.0)):
        armature.dafnet.root.location.y = y
        armature.dafnet.root.keyframe_insert("location", frame=frame)
    return saved(blender, tmp_path / "scene.blend")


def saved(bpy: ModuleType, file: Path) -> Path:
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    return file


def started(*arguments: object, first: str = "", **options: Any) -> "subprocess.Popen[str]":
    """The command in a process that does ``first`` before."""
    options = {
        "stdout": subprocess.PIPE,
        "stderr": subprocess.PIPE,
        "text": True,
        "encoding": "utf-8",
    } | options
    environment = {**os.environ, **options.pop("env", {})}
    return subprocess.Popen(
        [sys.executable, "-c", f"{first}\n{_RUN}", *map(str, arguments)],
        cwd=ROOT,
        env=environment,
        **options,
    )


def ran(*arguments: object, **options: Any) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of the command."""
    process = started(*arguments, **options)
    out, err = process.communicate()
    return process.returncode, without_blenders(out), without_blenders(err)


def names(folder: Path) -> list[str]:
    return sorted(each.name for each in folder.iterdir())


_AT = {
    "a file is loaded": "load_post",
    "the scene is read": "frame_change_post",
    "the file is saved": "save_post",
}
_SIGNALLED = """
import bpy, signal
seen = []
@bpy.app.handlers.persistent
def inside_blender(*_):
    if not seen:
        seen.append(1)
        signal.raise_signal(signal.{name})
    # Python raises what the signal asks for here, where Blender prints it and goes on.
    sum(range(1000))
bpy.app.handlers.{handler}.append(inside_blender)
"""


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("stage", _AT)
def test_a_signal_is_never_lost(scene: Path, tmp_path: Path, stage: str, name: str) -> None:
    out = tmp_path / "new" / "out.blend"
    code, said, err = ran(
        "bake", scene, "-o", out, first=_SIGNALLED.format(handler=_AT[stage], name=name)
    )
    assert (code, said, err.strip().splitlines()[-1]) == (
        130 if name == "SIGINT" else 143,
        "",
        "dafnet: stopped.",
    )
    assert "Traceback" not in err and names(tmp_path) == ["scene.blend"]


def test_a_signal_while_blender_starts_is_not_lost(scene: Path, tmp_path: Path) -> None:
    """Its scripts are Python, which an exception breaks off in their middle: at exit Blender then
    crashed.
    """
    first = """
import signal, sys
class Starting:
    def find_spec(self, name, path=None, target=None):
        if name == "bl_ui.space_view3d" and self in sys.meta_path:
            sys.meta_path.remove(self)
            signal.raise_signal(signal.SIGINT)
sys.meta_path.insert(0, Starting())
"""
    code, said, err = ran("bake", scene, "-o", tmp_path / "out.blend", first=first)
    assert (code, said, err.strip().splitlines()[-1]) == (130, "", "dafnet: stopped.")
    assert names(tmp_path) == ["scene.blend"]


def test_a_signal_while_numpy_loads_is_not_lost(scene: Path, tmp_path: Path) -> None:
    code = """
import runpy, signal, sys
class Loading:
    def find_spec(self, name, path=None, target=None):
        if name == "numpy.linalg" and self in sys.meta_path:
            sys.meta_path.remove(self)
            signal.raise_signal(signal.SIGINT)
sys.meta_path.insert(0, Loading())
sys.argv[0] = "dafnet"
runpy.run_module("dafnet_addon", run_name="__main__")
"""
    arguments = ["bake", str(scene), "-o", str(tmp_path / "out.blend")]
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], cwd=ROOT, capture_output=True, text=True
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "dafnet: stopped.\n")
    assert names(tmp_path) == ["scene.blend"]


def test_a_film_stops_at_a_frame(blender: ModuleType, tmp_path: Path) -> None:
    blender.context.scene.frame_end = 40
    blender.context.scene.camera = blender.data.objects.new(
        "Camera", blender.data.cameras.new("Camera")
    )
    blender.context.scene.render.resolution_percentage = 10
    shares: list[float] = []

    def stop(share: float) -> None:
        shares.append(share)
        if len(shares) == 3:
            raise KeyboardInterrupt(2)

    with pytest.raises(KeyboardInterrupt):
        render_film(blender.context.scene, tmp_path / "film.mp4", 2, stop)
    assert len(shares) == 3 and names(tmp_path) == []
    render_film(blender.context.scene, tmp_path / "film.mp4", 10)
    assert names(tmp_path) == ["film.mp4"]


def test_runs_that_write_to_one_file_leave_it_whole(
    scene: Path, blender: ModuleType, tmp_path: Path
) -> None:
    """And Blender keeps no older version beside it."""
    out = tmp_path / "out.blend"
    for _ in range(2):
        pair = [started("bake", scene, "-o", out, "--seed", seed, "--takes", 2) for seed in (1, 2)]
        for process in pair:
            _, err = process.communicate()
            assert process.returncode == 0, err
        assert names(tmp_path) == ["out.blend", "scene.blend"]
        blender.ops.wm.open_mainfile(filepath=str(out))
        assert sorted(
            action.dafnet.seed for action in blender.data.actions if len(action.keys()) > 0
        ) in ([1, 2], [2, 3])


def test_the_input_is_written_only_in_place(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = scene.read_bytes()
    link, hard = tmp_path / "link.blend", tmp_path / "hard.blend"
    link.symlink_to(scene)
    os.link(scene, hard)
    for output in (scene, tmp_path / ".." / tmp_path.name / "scene.blend", link, hard):
        code, _, err = ran("bake", scene, "-o", output)
        assert (code, err.count("\n")) == (1, 1) and "is the scene's own file" in err
    assert scene.read_bytes() == before and main(["bake", str(scene)]) == 2
    assert main(["bake", str(scene), "--in-place", "-o", "x.blend"]) == 2
    assert "one of the arguments -o/--output --in-place is required" in capsys.readouterr().err
    code, said, err = ran("bake", link, "--in-place", "--json")
    assert code == 0 and json.loads(said)["output"] == str(link), err
    assert scene.read_bytes() != before and link.is_symlink() and hard.read_bytes() == before
    assert names(tmp_path) == ["hard.blend", "link.blend", "scene.blend"]


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_names_that_the_terminal_cannot_show(scene: Path, tmp_path: Path, encoding: str) -> None:
    env = {"PYTHONIOENCODING": encoding}
    code, said, err = ran("bake", scene, "-o", tmp_path / "出力.blend", env=env)
    assert (
        code == 0 and "\\u82b1\\u5b50 take: 20 frames" in said and "\\u51fa\\u529b.blend" in said
    ), err
    code, said, err = ran("bake", scene, "-o", tmp_path / "x.blend", "--root", "根", env=env)
    assert (code, said) == (1, "") and "'\\u6839'" in err and "Traceback" not in err


@pytest.mark.skipif(os.name == "nt", reason="closed streams are a matter of POSIX")
def test_nobody_has_to_read(scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.blend"
    command = f'"{sys.executable}" -m dafnet_addon'
    ends = {
        f"{command} info | true": 0,
        f"{command} --help | true": 0,
        f"{command} info >&-": 0,
        f"{command} info >&- 2>&-": 0,
        f'{command} bake "{scene}" -o "{out}" 2>&1 | true': 0,
        f'{command} bake "{scene}" -o "{out}" <&- >&- 2>&-': 0,
        f'{command} bake none.blend -o "{out}" 2>&1 >&- | true': 1,
        f"{command} info --json > /dev/full": 1,
    }
    for line, expected in ends.items():
        out.unlink(missing_ok=True)
        done = subprocess.run(
            ["bash", "-o", "pipefail", "-c", line], cwd=ROOT, capture_output=True, text=True
        )
        assert (
            done.returncode == expected
            and "Traceback" not in done.stderr
            and "Exception" not in done.stderr
        ), line
        assert out.exists() == (" -o " in line and expected == 0), line
    assert (
        "standard output (No space left on device)" in done.stderr and done.stderr.count("\n") == 1
    )


_HIDDEN = """
import sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {modules}:
            raise ModuleNotFoundError(f"No module named '{{name}}'", name=name)
sys.meta_path.insert(0, Hidden())
"""
_BESIDES_NUMPY = {
    "torch",
    "matplotlib",
    "PIL",
    "scipy",
    "trimesh",
    "rtree",
    "safetensors",
    "tensorboard",
}


@pytest.mark.parametrize(
    ("arguments", "lacks"),
    [
        (["train", "config.toml", "data", "-o", "new"], "torch"),
        (["evaluate", "folder", "-o", "new"], "torch and matplotlib"),
        (["evaluate", "folder"], "torch"),
        (["evaluate", "folder", "--weights", "samp.checkpoint"], "torch"),
        (["evaluate", "folder", "--sheets", "new"], "torch and matplotlib and pillow"),
        (["prepare", "folder", "-o", "new"], "matplotlib"),
        (["bench", "speed"], "torch"),
        (["figures", "-o", "new"], "pillow"),
        (["bake", "a.blend", "-o", "new/b.blend"], "bpy"),
        (["demo", "-o", "new"], "bpy"),
    ],
)
def test_what_is_not_installed_is_said_first(
    tmp_path: Path, arguments: list[str], lacks: str
) -> None:
    hidden = _BESIDES_NUMPY | ({"bpy"} if lacks == "bpy" else set())
    filled = [str(tmp_path / "new") if each == "new" else each for each in arguments]
    code, said, err = ran(*filled, first=_HIDDEN.format(modules=hidden))
    or_inside = ", or run it inside Blender" if lacks == "bpy" else ""
    assert (code, said) == (1, "")
    assert err == (
        f"dafnet: This command needs {lacks}, which this Python does not have; install "
        f"it{or_inside}.\n"
    )
    assert names(tmp_path) == []


def test_the_demos_environment_is_enough_for_bake_and_seats(scene: Path, tmp_path: Path) -> None:
    hidden = _HIDDEN.format(modules=_BESIDES_NUMPY)
    code, said, err = ran("bake", scene, "-o", tmp_path / "out.blend", "--json", first=hidden)
    assert code == 0 and json.loads(said)["takes"], err
    for command in (
        "import dafnet_addon.blender.showcase.demo_room",
        "import runpy; runpy.run_path('benchmarks/seats.py')",
    ):
        subprocess.run(
            [sys.executable, "-c", f"{hidden}\n{command}"], cwd=ROOT, check=True, env={**os.environ}
        )


@pytest.mark.parametrize(
    ("option", "values"),
    [
        ("--seed", ["-1", "2147483648", "3000000000", "1.5", "x", "9" * 5000]),
        ("--takes", ["0", "-3", "nan"]),
        ("--temperature", ["nan", "inf", "-1", "-inf"]),
        ("--plant-feet", ["nan", "inf", "-0.1", "1.1"]),
        ("--rest-on-seats", ["2"]),
        ("--reach-targets", ["-1"]),
        ("--clear-furniture", ["nan"]),
        ("--smooth", ["1e9"]),
        ("--frames", ["7", "a:b", "1:nan"]),
        ("--mode", ["free"]),
    ],
)
def test_values_that_mean_nothing(
    option: str, values: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    for value in values:
        assert main(["bake", "a.blend", "-o", "b.blend", f"{option}={value}"]) == 2
        said = capsys.readouterr()
        assert (
            said.out == ""
            and f"argument {option}: " in said.err.splitlines()[-1]
            and value in said.err.splitlines()[-1]
        )


@pytest.mark.parametrize(
    ("command", "values"),
    [
        (
            ["prepare", "folder", "-o", "x"],
            ["--windows=0", "--windows=-5", "--processes=0", "--processes=1e9", "--seed=-1"],
        ),
        (["train", "c.toml", "d", "-o", "x"], ["--minutes=nan", "--minutes=inf", "--minutes=-1"]),
        (["demo"], ["--seed=-1", "--temperature=nan"]),
    ],
)
def test_values_of_other_commands(
    command: list[str], values: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    for value in values:
        assert main([*command, value]) == 2
        assert f"argument {value.partition('=')[0]}: " in capsys.readouterr().err.splitlines()[-1]


def _refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """The sentence with which ``bake`` refuses."""
    capsys.readouterr()
    assert cli.main(["bake", *map(str, arguments)]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    return err.strip().splitlines()[-1]


def _baked(capsys: pytest.CaptureFixture[str], *arguments: object) -> Any:
    """The report of ``bake``."""
    capsys.readouterr()
    code = cli.main(["bake", *map(str, arguments), "--json"])
    out, err = capsys.readouterr()
    assert code == 0, err
    return json.loads(out)


def test_a_failed_bake_makes_no_folder(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "no armature" in _refused(
        capsys, scene, "-o", tmp_path / "new" / "out.blend", "--character", "Nobody"
    )
    assert names(tmp_path) == ["scene.blend"]


def test_a_character_in_another_scene(
    blender: ModuleType,
    scene: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    blender.context.scene.name = "Walk"
    other = blender.data.scenes.new("Empty")
    blender.context.window.scene = other
    saved(blender, scene)
    out = tmp_path / "out.blend"
    said = _refused(capsys, scene, "-o", out)
    assert said.endswith(
        "The scene 'Empty' has no character; the scene 'Walk' has '花子': give --scene 'Walk'."
    )
    assert "give --scene 'Walk'" in _refused(capsys, scene, "-o", out, "--character", "花子")
    assert "no scene 'Run'; choose one of 'Empty', 'Walk'" in _refused(
        capsys, scene, "-o", out, "--scene", "Run"
    )
    there = _baked(capsys, scene, "-o", out, "--scene", "Walk")
    blender.ops.wm.open_mainfile(filepath=str(out))
    assert blender.context.scene.name == "Empty", "the active scene stays"
    blender.context.window.scene = blender.data.scenes["Walk"]
    saved(blender, scene)
    here = _baked(capsys, scene, "-o", out)
    assert [take["metrics"] for take in here["takes"]] == [
        take["metrics"] for take in there["takes"]
    ]


def test_files_that_are_no_scenes(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = tmp_path / "broken.blend"
    for content in (b"", b"hello", scene.read_bytes()[: len(scene.read_bytes()) // 2]):
        broken.write_bytes(content)
        assert "cannot be opened by Blender" in _refused(
            capsys, broken, "-o", tmp_path / "out.blend"
        )
    assert "There is no file" in _refused(
        capsys, tmp_path / "none.blend", "-o", tmp_path / "out.blend"
    )
    assert names(tmp_path) == ["broken.blend", "scene.blend"]


def test_a_file_of_a_newer_blender(
    blender: ModuleType,
    scene: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    newer = tmp_path / "newer.blend"
    blender.ops.wm.save_as_mainfile(filepath=str(newer), compress=False)
    raw = newer.read_bytes()
    at = raw.index(b"v", 7) + 1
    newer.write_bytes(
        raw[:at] + b"9" + raw[at + 1 :]
        if raw[at : at + 1] != b"0"
        else raw[:at] + b"09" + raw[at + 2 :]
    )
    out = tmp_path / "out.blend"
    assert "which is newer than this one" in _refused(capsys, newer, "--in-place")
    warnings = _baked(capsys, newer, "-o", out)["warnings"]
    assert any("which is newer than this one, so parts" in warning for warning in warnings)


def test_what_the_scene_links(
    blender: ModuleType,
    scene: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A library is never the output; one that is missing is said; paths hold from the output's
    folder.
    """
    library = tmp_path / "library.blend"
    blender.data.libraries.write(str(library), {blender.data.objects.new("Prop", None)})
    with blender.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.objects = ["Prop"]
    blender.context.scene.collection.objects.link(wanted.objects[0])
    wanted.objects[0].library.filepath = "//library.blend"
    saved(blender, scene)
    assert "is a library of the scene" in _refused(capsys, scene, "-o", library)
    out = tmp_path / "deeper" / "out.blend"
    assert not any("library" in warning for warning in _baked(capsys, scene, "-o", out)["warnings"])
    blender.ops.wm.open_mainfile(filepath=str(out))
    (found,) = blender.data.libraries
    assert found.filepath == "//../library.blend" and not found.is_missing
    library.unlink()
    warnings = _baked(capsys, scene, "-o", out)["warnings"]
    assert any("The library '//library.blend' is missing" in warning for warning in warnings)


@pytest.mark.parametrize("allowed", [False, True])
def test_scripts_of_a_file_run_only_where_blender_lets_them(
    blender: ModuleType,
    scene: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    allowed: bool,
) -> None:
    made = tmp_path / "made_by_a_script"
    text = blender.data.texts.new("script.py")
    text.write(f"open({str(made)!r}, 'w').close()")
    text.use_module = True
    saved(blender, scene)
    preferences = blender.context.preferences.filepaths
    assert not preferences.use_scripts_auto_execute
    preferences.use_scripts_auto_execute = allowed
    try:
        warnings = _baked(capsys, scene, "-o", tmp_path / "out.blend")["warnings"]
    finally:
        preferences.use_scripts_auto_execute = False
    assert made.exists() == allowed
    assert any("script in the file did not run" in warning for warning in warnings) == (not allowed)
