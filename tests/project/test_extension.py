"""The extension's zip: Blender's own tool builds and validates it, it holds what an animator needs,
installs and goes.

Also the rules that every module keeps: the core does not know Blender, and nothing of the product
imports upward.
"""

import ast
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import TypeGuard

import pytest

from dafnet_addon.core.weights import load_weights
from kit.messages import without_blenders
from kit.places import ROOT

SHIPPED = {
    "__init__.py",
    "blender_manifest.toml",
    "dafnet_addon",
    "operators",
    "panels",
    "weights_stub",
    "LICENSE",
    "LICENSE-WEIGHTS.md",
    "README.md",
    "docs",
    "pages",
}
LEFT_OUT = {"model", "data", "training", "baselines"}
PACKAGES = ("core", "director", "batch", "blender")
OF_A_CHECKOUT = {
    f"{name}.py"
    for name in ("prepare", "train", "carry", "validate", "cool", "evaluate", "bench", "figures")
}
"""Commands that the zip does not have."""

LIFE = """
import os, sys, bpy, addon_utils
zipped, module = sys.argv[-1], "bl_ext.user_default.dafnet"
install = bpy.ops.extensions.package_install_files
assert install(filepath=zipped, repo="user_default", enable_on_install=True) == {"FINISHED"}
assert module in bpy.context.preferences.addons and addon_utils.check(module)[1]
assert bpy.ops.dafnet.add_character() == {"FINISHED"}
character, scene = bpy.context.object, bpy.context.scene
scene.frame_start, scene.frame_end = 1, 12
assert bpy.ops.dafnet.generate() == {"FINISHED"}
assert character.animation_data.action
assert bpy.ops.preferences.addon_disable(module=module) == {"FINISHED"}
assert not hasattr(bpy.types.Object, "dafnet") and not hasattr(bpy.types, "DAFNET_PT_character")
assert bpy.ops.preferences.addon_enable(module=module) == {"FINISHED"}
repos = bpy.context.preferences.extensions.repos
index = next(i for i, repo in enumerate(repos) if repo.module == "user_default")
assert bpy.ops.extensions.package_uninstall(repo_index=index, pkg_id="dafnet") == {"FINISHED"}
assert module not in bpy.context.preferences.addons and not hasattr(bpy.types.Object, "dafnet")
assert not os.path.exists(os.path.join(repos[index].directory, "dafnet"))
print("lived")
sys.stdout.flush(); sys.stderr.flush(); os._exit(0)
"""


def tool(*arguments: str | Path) -> str:
    """Run Blender's extension tool."""
    bpy = pytest.importorskip("bpy")
    programs = (
        Path(folder, "addons_core/bl_pkg/cli/blender_ext.py") for folder in bpy.utils.script_paths()
    )
    program = next(path for path in programs if path.exists())
    done = subprocess.run(
        [sys.executable, program, *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def zipped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("build")
    tool("build", "--source-dir", ROOT, "--output-dir", folder)
    return next(folder.glob("dafnet-*.zip"))


def test_the_source_and_the_zip_validate(zipped: Path) -> None:
    assert "Success" in tool("validate", ROOT) and "Success" in tool("validate", zipped)


def test_the_zip_holds_what_an_animator_needs(zipped: Path) -> None:
    assert zipped.stat().st_size < 100e6
    names = [PurePosixPath(name) for name in zipfile.ZipFile(zipped).namelist()]
    assert {name.parts[0] for name in names} <= SHIPPED
    assert not {name.parts[1] for name in names if name.parts[0] == "dafnet_addon"} & LEFT_OUT
    assert {name.parts[1] for name in names if name.parts[0] == "docs"} == {"guide.md", "guide"}
    assert not [
        name
        for name in names
        if "__pycache__" in name.parts or name.suffix in {".pyc", ".zip", ".blend"}
    ]
    shipped = {str(name) for name in names}
    for folder in ("rig/shipped_maps", "presets/dafnet"):
        files = {
            path for path in (ROOT / "dafnet_addon/blender" / folder).iterdir() if path.is_file()
        }
        assert files and {str(path.relative_to(ROOT)) for path in files} <= shipped
    commands = {name.name for name in names if name.parent.name == "commands"}
    assert commands == {file.name for file in modules("dafnet_addon/commands")} - OF_A_CHECKOUT
    for package in (*(f"dafnet_addon/{part}" for part in PACKAGES), "operators", "panels"):
        assert {str(path.relative_to(ROOT)) for path in (ROOT / package).rglob("*.py")} <= shipped
    assert any(name.parts[0] == "weights_stub" and name.suffix == ".safetensors" for name in names)


def test_the_guide_goes_along_as_pages(tmp_path: Path) -> None:
    """What scripts/build_zip.sh builds opens from a disk: its links and pictures are in the zip."""
    pytest.importorskip("mkdocs")
    pytest.importorskip("bpy")
    source = tmp_path / "source"  # other tests may be at work in this one
    unneeded = shutil.ignore_patterns(".*", "build", "out", "pages", "tests", "__pycache__")
    shutil.copytree(ROOT, source, ignore=unneeded)
    subprocess.run([source / "scripts" / "build_zip.sh", sys.executable], check=True)
    with zipfile.ZipFile(next((source / "build").glob("dafnet-*.zip"))) as archive:
        names = set(archive.namelist())
        pages = {name: archive.read(name).decode() for name in names if name.endswith(".html")}
    assert {"pages/guide.html", "pages/tasks.html", "pages/reference/operators.html"} <= set(pages)
    assert sum(map(len, pages.values())) < 400_000, "lean"
    for name, text in pages.items():
        assert "<h1" in text
        for target in re.findall(r'(?:src|href)="([^"#:]+)', text):
            path = os.path.normpath(PurePosixPath(name).parent / target)
            assert path in names, (name, target)


def test_it_installs_generates_and_goes_without_a_word(zipped: Path, tmp_path: Path) -> None:
    import bpy

    script = tmp_path / "life.py"
    script.write_text(LIFE, encoding="utf-8")
    (tmp_path / "user").mkdir()
    command = [sys.executable, script, zipped]
    if bpy.app.binary_path:
        command = [bpy.app.binary_path, "-b", "--factory-startup", "--python-exit-code", "1"]
        command += ["--python", script, "--", zipped]
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "user")}
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, env=environment, cwd=tmp_path
    )
    assert done.returncode == 0 and "lived" in done.stdout, done.stdout + done.stderr
    assert without_blenders(done.stderr) == ""


def imports(path: Path, at_load_only: bool = False) -> set[str]:
    """Names of imported modules, relative ones with their dots; all, or those that loading the
    module imports.
    """
    tree = ast.parse(path.read_text(encoding="utf-8"))
    names: set[str] = set()
    for node in tree.body if at_load_only else ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            names.add("." * node.level + (node.module or ""))
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    return names


def modules(*folders: str) -> list[Path]:
    return [path for folder in folders for path in (ROOT / folder).rglob("*.py")]


@pytest.mark.parametrize("path", modules("dafnet_addon/core"), ids=lambda path: path.name)
def test_the_core_needs_numpy_only(path: Path) -> None:
    outside = {name.split(".")[0] for name in imports(path, at_load_only=True) if name[0] != "."}
    assert outside <= set(sys.stdlib_module_names) | {"numpy"}


LOWER = ("dafnet_addon/core", "dafnet_addon/model", "dafnet_addon/data", "dafnet_addon/training")


@pytest.mark.parametrize(
    "path", modules(*LOWER), ids=lambda path: f"{path.parent.name}/{path.name}"
)
def test_nothing_below_blender_imports_it_or_reaches_out_of_the_package(path: Path) -> None:
    depth = len(path.relative_to(ROOT / "dafnet_addon").parts)
    for name in imports(path):
        assert name.split(".")[0] not in {"bpy", "mathutils", "bpy_extras", "dafnet_addon"}
        assert not name.startswith("." * (depth + 1)), name
        assert not re.match(r"\.+(blender|cli)\b", name), name


@pytest.mark.parametrize(
    "path",
    [ROOT / "__init__.py", *modules("dafnet_addon/blender", "operators", "panels")],
    ids=lambda path: f"{path.parent.name}/{path.name}",
)
def test_the_extension_imports_itself_relatively(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert "dafnet_addon" not in {name.split(".")[0] for name in imports(path)}
    if re.search(r"class \w+\(bpy\.types\.", text):
        assert "from __future__ import annotations" not in text


def interface_files() -> list[Path]:
    files = modules("operators", "panels", "dafnet_addon/blender")
    tables = {"translations.py", "german_tooltips.py"}
    return [file for file in files if file.name not in tables]


def translated() -> list[str]:
    """The words of the translation tables."""
    tables = ast.parse((ROOT / "dafnet_addon/blender/translations.py").read_text(encoding="utf-8"))
    return [
        str(key.value)
        for node in ast.walk(tables)
        if isinstance(node, ast.Dict)
        for key in node.keys
        if isinstance(key, ast.Constant) and not re.fullmatch("[a-z]{2,3}_[A-Z]{2}", key.value)
    ]


def test_what_is_translated_is_said_somewhere() -> None:
    """Every word of the translation tables is one that the add-on shows."""
    sources = "\n".join(file.read_text(encoding="utf-8") for file in interface_files())
    assert len(translated()) > 50
    assert not [word for word in translated() if f'"{word}"' not in sources]


def test_every_language_has_every_word() -> None:
    tree = ast.parse((ROOT / "dafnet_addon/blender/translations.py").read_text(encoding="utf-8"))
    tables = [ast.literal_eval(node.value) for node in tree.body if _is_table(node)]
    assert tables and all(table.keys() == tables[0].keys() for table in tables)
    assert all(said.strip() for table in tables for said in table.values())


def _is_table(node: ast.stmt) -> TypeGuard[ast.Assign]:
    """Whether a statement gives words in a language."""
    return (
        isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Dict)
        and ast.unparse(node.targets[0]) != "_LANGUAGES"
    )


BLENDERS_OWN = {
    *("Action", "End", "FK", "Head", "Height", "Help", "IK", "Name", "Next", "Object", "Preset"),
    *("Previous", "Sensor", "Speed", "Start", "Step"),
}
"""Words that Blender translates itself."""

THE_SAME = {"BVH", "DAFNet", "DAFNet Rig", "EE", "FBX", "FREE", "FULL", "USD", "glTF"}
"""Words that are the same in all languages."""

UNSEEN = {
    *("Collisions before", "Convention", "Jerk before", "Miss before", "Row", "Sliding before"),
    *("Slide before", "Touching before"),
    *("Task", "This"),
}
"""Names of properties that no panel shows by them."""


def interface_words(file: Path) -> Iterator[str]:
    """The labels of a source's operators, panels, properties and buttons."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "bl_label":
            yield ast.literal_eval(node.value)
        if not isinstance(node, ast.Call):
            continue

        called = ast.unparse(node.func)
        given = {keyword.arg: keyword.value for keyword in node.keywords}
        label = given.get("name" if called.endswith("Property") else "text")
        if isinstance(label, ast.Constant) and re.search(
            r"Property$|\.(operator|label|prop)$", called
        ):
            yield label.value
        if called == "EnumProperty" and isinstance(items := given["items"], ast.List):
            yield from (ast.literal_eval(item.elts[1]) for item in items.elts)  # type: ignore[attr-defined]


def test_what_the_interface_says_is_translated() -> None:
    shown = {word for file in interface_files() for word in interface_words(file) if word}
    assert shown - {*translated(), *BLENDERS_OWN, *THE_SAME, *UNSEEN} == set()


def shipped_sources(zipped: Path) -> dict[str, ast.Module]:
    """What the zip's Python files say, by name."""
    with zipfile.ZipFile(zipped) as archive:
        names = [name for name in archive.namelist() if name.endswith(".py")]
        return {name: ast.parse(archive.read(name).decode("utf-8")) for name in names}


EXPLAINED = {
    "ctypes": {"dafnet_addon/core/threads.py"},
    "subprocess": {"dafnet_addon/batch/making.py"},
    "torch": {"dafnet_addon/core/backend.py"},
    "distributed": {"dafnet_addon/batch/cluster.py"},
}
"""Modules that a reviewer asks about, and where alone each is used; docs/platform.md says why."""

NEVER = {
    *("socket", "ssl", "http", "urllib", "ftplib", "smtplib", "asyncio", "requests", "webbrowser"),
    *("pip", "ensurepip", "venv", "pickle", "shelve", "marshal", "multiprocessing", "site"),
}
"""What reaches a network, installs, or runs what a file says."""


def imported_names(tree: ast.Module) -> set[str]:
    """The outermost modules of others that a file imports, anywhere in it."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            found.add((node.module or "").split(".")[0])
    return found


def test_what_ships_reaches_no_network_and_installs_nothing(zipped: Path) -> None:
    used: dict[str, set[str]] = {}
    for name, tree in shipped_sources(zipped).items():
        for module in imported_names(tree):
            used.setdefault(module, set()).add(name)
    assert not NEVER & used.keys()
    assert {module: used[module] for module in EXPLAINED} == EXPLAINED
    of_blender = {"bpy", "bmesh", "mathutils", "gpu", "gpu_extras", "blf", "bpy_extras"}
    of_blender |= {"addon_utils", "bl_operators", "bl_ui", "io_scene_gltf2", "numpy"}
    assert used.keys() <= {*sys.stdlib_module_names, *of_blender, *EXPLAINED}
    page = (ROOT / "docs" / "platform.md").read_text(encoding="utf-8")
    for files in EXPLAINED.values():
        assert all(f"`{file}`" in page for file in files)


def test_what_ships_runs_no_text_and_touches_no_path(zipped: Path) -> None:
    """No ``eval`` or ``exec``, no change of ``sys.path``, no shell."""
    for name, tree in shipped_sources(zipped).items():
        calls = {ast.unparse(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
        assert not calls & {"eval", "exec", "compile", "__import__", "os.system", "os.popen"}, name
        assert not [call for call in calls if call.startswith("sys.path")], name


def test_the_interface_offers_no_engine_of_others() -> None:
    words = {word for file in interface_files() for word in interface_words(file) if word}
    texts = "\n".join(file.read_text(encoding="utf-8") for file in modules("panels"))
    assert not [word for word in words if re.search("torch|cuda|metal", word, re.I)]
    assert not re.search("torch|cuda|checkout", texts, re.I)


def test_the_manifest_says_whose_it_is_and_under_which_licences() -> None:
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later", "SPDX:CC-BY-4.0"]
    assert all(re.fullmatch(r"\d{4}(-\d{4})? \S.*", line) for line in manifest["copyright"])
    assert set(manifest["tags"]) == {"Animation", "Rigging", "Pipeline"}
    assert manifest["permissions"].keys() == {"files", "clipboard"}, "no network"
    weights = load_weights(ROOT / "weights_stub" / "dafnet.safetensors")
    assert str(weights.says("licence")).startswith("CC-BY-4.0")
