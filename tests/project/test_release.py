"""A release is prepared by one command, and Blender installs and updates from the repository that
is made of it, with all that is the user's kept.
"""

import datetime
import json
import os
import re
import runpy
import shutil
import subprocess
import sys
import tomllib
import zipfile
from hashlib import sha256
from pathlib import Path

import pytest

from kit.places import ROOT

RELEASE = runpy.run_path(str(ROOT / "scripts" / "release.py"))
NOT_OF_THE_SOURCE = (".*", "build", "out", "tests", "__pycache__")
OLD, NEW = "0.1.0", "99.0.0"
CHANGES = """# Changelog

## 1 (unreleased)

- Chairs.

## 0.0.1 (2026-01-01)

- Before.
"""
DAY = datetime.date(2026, 12, 1)

SHOT = """
import hashlib, os, shutil, sys
from pathlib import Path
import bpy
import addon_utils

work, step = Path(sys.argv[-2]), sys.argv[-1]
module, site, own = "bl_ext.site.dafnet", work / "site", str(work / "own.safetensors")
preferences = bpy.context.preferences
preferences.system.use_online_access = True  # Blender asks for it, whatever the address


def version():
    return sys.modules[module].dafnet_addon.core.manifest.current_version()


def takes():
    # Of Ann, by name and hash of what is kept in each.
    actions = [row.action for row in bpy.data.objects["Ann"].dafnet.takes]
    kept = {action.name: action["dafnet_take"] for action in actions}
    return {name: hashlib.sha256(packed).hexdigest() for name, packed in sorted(kept.items())}


def publish(name):
    shutil.rmtree(site, ignore_errors=True)
    shutil.copytree(work / name, site)
    repos = preferences.extensions.repos
    index = next(i for i, repo in enumerate(repos) if repo.module == "site")
    assert bpy.ops.extensions.repo_sync(repo_index=index) == {"FINISHED"}
    return index


def add_repository():
    address = (site / "index.json").as_uri()
    preferences.extensions.repos.new(name="Site", module="site", remote_url=address)
    preferences.extensions.repos[-1].use_remote_url = True


if step == "work and update":
    add_repository()
    install = bpy.ops.extensions.package_install
    index = publish("old")
    assert install(repo_index=index, pkg_id="dafnet", enable_on_install=True) == {"FINISHED"}
    assert version() == "0.1.0"
    preferences.addons[module].preferences.weights = own
    assert bpy.ops.dafnet.add_character(name="Ann") == {"FINISHED"}
    ann = bpy.context.object
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 10
    ann.dafnet.temperature, ann.dafnet.take_count = 0.75, 2
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    assert bpy.ops.dafnet.add_preset(name="Mine") == {"FINISHED"}
    print("takes", takes())
    bpy.ops.wm.save_as_mainfile(filepath=str(work / "shot.blend"))

    publish("new")  # while the shot is open
    assert bpy.ops.extensions.package_upgrade_all() == {"FINISHED"}
    assert version() == "99.0.0", version()
    assert preferences.addons[module].preferences.weights == own
    print("takes", takes())
    assert bpy.ops.wm.save_userpref() == {"FINISHED"}
else:  # the next day
    if bpy.app.version >= (4, 5):
        bpy.ops.wm.read_userpref()
        assert preferences.addons[module].preferences.weights == own
    else:  # whose module crashes when it reads preferences
        add_repository()
    addon_utils.extensions_refresh(ensure_wheels=True)  # as a start does
    assert bpy.ops.preferences.addon_enable(module=module) == {"FINISHED"}
    assert version() == "99.0.0"
    folders = bpy.utils.preset_paths("dafnet")
    assert "mine.py" in [file.lower() for folder in folders for file in os.listdir(folder)]
    bpy.ops.wm.open_mainfile(filepath=str(work / "shot.blend"))
    ann = bpy.data.objects["Ann"]
    before = takes()
    assert len(before) == 2
    bpy.context.view_layer.objects.active = ann
    assert ann.dafnet.temperature == 0.75 and ann.dafnet.take_count == 2
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    assert before.items() < takes().items()
    print("takes", before)
sys.stdout.flush(); sys.stderr.flush(); os._exit(0)
"""


def source(folder: Path) -> Path:
    """A copy of what a release is made of, whose changelog has an unreleased part."""
    copy = folder / "source"
    shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(*NOT_OF_THE_SOURCE))
    (copy / "CHANGELOG.md").write_text(CHANGES, encoding="utf-8")
    for name in ("blender_manifest.toml", "pyproject.toml", "CITATION.cff"):
        text = (copy / name).read_text(encoding="utf-8")
        current = RELEASE["current"](copy)
        (copy / name).write_text(text.replace(current, OLD), encoding="utf-8")
    return copy


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return source(tmp_path_factory.mktemp("release"))


def texts(folder: Path) -> dict[str, str]:
    files = [file for file in folder.iterdir() if file.is_file()]
    return {file.name: file.read_text(encoding="utf-8") for file in files}


def run(script: Path, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, script, *arguments], capture_output=True, text=True, encoding="utf-8"
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_a_version_is_cut_in_every_file_that_says_it(tmp_path: Path) -> None:
    folder = source(tmp_path)
    before = texts(folder)
    for version in ("0.2", "0.0.1", "0.0.9", "v0.2.0"):
        with pytest.raises(ValueError, match=r"[Vv]ersion"):
            RELEASE["cut"](folder, version, DAY)
    assert texts(folder) == before, "what cannot be cut changes nothing"

    RELEASE["cut"](folder, "0.2.0", DAY)
    assert RELEASE["current"](folder) == "0.2.0"
    project = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["project"]["version"] == "0.2.0"
    assert "\nversion: 0.2.0\n" in (folder / "CITATION.cff").read_text(encoding="utf-8")
    assert RELEASE["changes_of"](folder, "0.2.0") == "- Chairs.\n\n"
    with pytest.raises(ValueError, match="unreleased"):
        RELEASE["cut"](folder, "0.3.0", DAY)


def test_the_files_of_today_say_one_version() -> None:
    for name, pattern in RELEASE["VERSIONED"].items():
        found = re.search(pattern, (ROOT / name).read_text(encoding="utf-8"))
        assert found and found[1] == RELEASE["current"](ROOT), name


def test_an_address_is_written_once(tmp_path: Path) -> None:
    shutil.copy(ROOT / "blender_manifest.toml", tmp_path)
    for address in ("https://first.example", "https://second.example/dafnet"):
        RELEASE["with_website"](tmp_path, address)
        manifest = (tmp_path / "blender_manifest.toml").read_text(encoding="utf-8")
        assert tomllib.loads(manifest)["website"] == address


def test_what_is_not_known_to_be_ours_is_not_released(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "odd.zip", "w") as archive:
        archive.writestr("wheels/some.whl", "")
    with pytest.raises(ValueError, match=r"some\.whl"):
        RELEASE["parts_list"](tmp_path / "odd.zip")


def built(copy: Path, *arguments: str) -> Path:
    """The zip of a copy's release."""
    run(copy / "scripts" / "release.py", *arguments)
    return next((copy / "build" / "release").glob("*.zip"))


@pytest.mark.slow
def test_from_release_to_update(copy: Path, tmp_path: Path) -> None:
    """The whole way: two releases, a repository of each, a Blender that installs the first, works,
    and updates to the second.
    """
    bpy = pytest.importorskip("bpy")
    if bpy.app.binary_path:
        pytest.skip("needs the module bpy, by which a release is made")
    if os.name == "nt":
        pytest.skip("a release is made where bash is")

    changes = copy / "CHANGELOG.md"
    first = CHANGES.replace("## 1 (unreleased)", f"## {OLD} (2026-11-01)")
    changes.write_text(first, encoding="utf-8")
    old = shutil.copy(built(copy), tmp_path)
    second = first.replace("log\n", "log\n\n## 2 (unreleased)\n\n- Sofas.\n")
    changes.write_text(second, encoding="utf-8")
    new = built(copy, NEW, "--website", "https://site.example")

    folder = new.parent
    digest = sha256(new.read_bytes()).hexdigest()
    assert (folder / f"{new.name}.sha256").read_text(encoding="utf-8") == f"{digest}  {new.name}\n"
    assert (folder / "CHANGES.md").read_text(encoding="utf-8") == "- Sofas.\n\n"
    parts = json.loads((folder / f"dafnet-{NEW}.cdx.json").read_text(encoding="utf-8"))
    assert parts["metadata"]["component"]["hashes"][0]["content"] == digest
    weights = sha256((ROOT / RELEASE["WEIGHTS"]).read_bytes()).hexdigest()
    (component,) = parts["components"]
    assert component["hashes"][0]["content"] == weights
    assert component["licenses"] == [{"license": {"id": "CC-BY-4.0"}}]

    for name, zipped in (("old", old), ("new", new)):
        command = [copy / "scripts" / "repository.sh", sys.executable, tmp_path / name, zipped]
        subprocess.run(command, check=True, capture_output=True)
    assert NEW in (tmp_path / "new" / "index.html").read_text(encoding="utf-8")

    (tmp_path / "user").mkdir()
    shutil.copy(ROOT / RELEASE["WEIGHTS"], tmp_path / "own.safetensors")
    (tmp_path / "shot.py").write_text(SHOT, encoding="utf-8")
    said = []
    for step in ("work and update", "the next day"):
        done = subprocess.run(
            [sys.executable, tmp_path / "shot.py", tmp_path, step],
            capture_output=True,
            text=True,
            encoding="utf-8",
            env={**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "user")},
            cwd=tmp_path,
        )
        assert done.returncode == 0, done.stdout[-3000:] + done.stderr
        said += [line for line in done.stdout.splitlines() if line.startswith("takes ")]
    assert len(said) == 3 and len(set(said)) == 1, "the same takes, to the last bit"
