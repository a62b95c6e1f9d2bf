"""One direction of flow: what each part of the project may import, read from its source."""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from kit.places import ROOT

PACKAGE = ROOT / "dafnet_addon"
FOLDERS = ("dafnet_addon", "operators", "panels", "benchmarks")


@cache
def tree_of(file: Path) -> ast.Module:
    """What a source file says, read once for all tests."""
    return ast.parse(file.read_text(encoding="utf-8"))


def imports(file: Path, top_level_only: bool = False) -> Iterator[tuple[int, str]]:
    """(level, module) of every import of a file; level counts the leading dots."""
    tree = tree_of(file)
    nodes = tree.body if top_level_only else list(ast.walk(tree))
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from ((0, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.level, node.module or ""


def outside(file: Path, top_level_only: bool = False) -> set[str]:
    """Top-level names of the modules outside the project that a file imports."""
    return {module.split(".")[0] for level, module in imports(file, top_level_only) if level == 0}


def sources(*folders: str) -> list[Path]:
    return sorted(file for folder in folders for file in (ROOT / folder).rglob("*.py"))


def test_there_is_something_to_check() -> None:
    assert len(sources("dafnet_addon/core")) > 10
    assert sources("operators") and sources("panels")


@pytest.mark.parametrize("file", sources("dafnet_addon/core"), ids=lambda file: file.stem)
def test_core_needs_numpy_only(file: Path) -> None:
    allowed = {"numpy", *sys.stdlib_module_names}
    assert outside(file, top_level_only=True) <= allowed
    assert outside(file) <= allowed | {"torch"}, (
        "torch may run the sampler where it is installed, nothing else may"
    )


@pytest.mark.parametrize(
    "file", sources(*FOLDERS), ids=lambda file: file.relative_to(ROOT).as_posix()
)
def test_only_the_blender_side_imports_bpy(file: Path) -> None:
    host = {"bpy", "bmesh", "mathutils", "addon_utils"} & outside(file)
    place = file.relative_to(ROOT).parts
    if place[0] in ("operators", "panels") or place[:2] == ("dafnet_addon", "blender"):
        return
    assert not host


@pytest.mark.parametrize(
    "file",
    [
        f
        for f in sources("dafnet_addon", "operators", "panels")
        if f.parent.name not in ("model", "training", "baselines")
    ],
    ids=lambda file: file.relative_to(ROOT).as_posix(),
)
def test_what_runs_inside_blender_needs_no_torch(file: Path) -> None:
    heavy = {"torch", "scipy", "trimesh", "safetensors", "matplotlib"}
    assert not heavy & outside(file, top_level_only=True)


@pytest.mark.parametrize(
    "file", sources("dafnet_addon"), ids=lambda file: file.relative_to(PACKAGE).as_posix()
)
def test_the_package_imports_relatively_and_never_upward(file: Path) -> None:
    depth = len(file.relative_to(PACKAGE).parts)
    for level, module in imports(file):
        assert level <= depth, f"{module} is outside the package"
        assert not (level == 0 and module.split(".")[0] == "dafnet_addon"), (
            f"import {module} relatively"
        )


def test_core_does_not_know_its_users() -> None:
    for file in sources("dafnet_addon/core"):
        for level, module in imports(file):
            assert level < 2, f"{file.name} imports {module} from outside the core"


@pytest.mark.parametrize(
    "file", sources(*FOLDERS), ids=lambda file: file.relative_to(ROOT).as_posix()
)
def test_blender_classes_keep_real_annotations(file: Path) -> None:
    if "bpy" in outside(file):
        assert (0, "__future__") not in set(imports(file))


@pytest.mark.parametrize("file", sources("operators"), ids=lambda file: file.stem)
def test_operators_say_what_they_do_and_their_base_reports(file: Path) -> None:
    """What they share is in one place: errors become reports, and the set is returned."""
    if file.stem == "base":
        return
    tree = tree_of(file)
    methods = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    assert "execute" not in methods


def test_nothing_names_the_data_beside_the_repository() -> None:
    for file in [
        *sources(*FOLDERS),
        *(file for file in (ROOT / "scripts").rglob("*.*") if "__pycache__" not in file.parts),
        ROOT / "Makefile",
        ROOT / "README.md",
    ]:
        assert "../shared" not in file.read_text(encoding="utf-8"), file


def _opens_text(call: ast.Call) -> bool:
    """Whether a call reads or writes text with the encoding of the machine's locale."""
    is_method = isinstance(call.func, ast.Attribute)
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    given = {keyword.arg: keyword.value for keyword in call.keywords}
    if "encoding" in given or name not in ("read_text", "write_text", "open"):
        return False
    if name != "open":
        return True
    # open(file, mode), Path.open(mode); a method that is told of a file is another, such as
    # ZipFile.open.
    modes = [*call.args[0 if is_method else 1 :], *([given["mode"]] if "mode" in given else [])]
    words = [
        mode.value
        for mode in modes
        if isinstance(mode, ast.Constant) and isinstance(mode.value, str)
    ]
    if is_method and len(words) < len(modes):
        return False
    return not any("b" in word for word in words)


@pytest.mark.parametrize(
    "file", sources(*FOLDERS, "tests"), ids=lambda file: file.relative_to(ROOT).as_posix()
)
def test_text_is_read_and_written_in_one_encoding_everywhere(file: Path) -> None:
    calls = [node for node in ast.walk(tree_of(file)) if isinstance(node, ast.Call)]
    lines = [call.lineno for call in calls if _opens_text(call)]
    assert not lines, f'{file.name}: say encoding="utf-8" in line {lines}'


@pytest.mark.parametrize(
    "file", sources("dafnet_addon"), ids=lambda file: file.relative_to(ROOT).as_posix()
)
def test_what_users_keep_is_written_whole(file: Path) -> None:
    """That is, to the ``part`` of ``core.files.whole_file``, by which weights are written in
    ``training.export``.
    """
    calls = [node for node in ast.walk(tree_of(file)) if isinstance(node, ast.Call)]
    written = {
        "write_text": lambda call: call.func.value,
        "write_bytes": lambda call: call.func.value,
    }
    written |= dict.fromkeys(
        ("savefig", "save_as_mainfile"),
        lambda call: [*call.args, *(k.value for k in call.keywords)][0],
    )
    to = {
        ast.unparse(written[c.func.attr](c))
        for c in calls
        if getattr(c.func, "attr", "") in written
    }
    assert to <= {"part", "str(part)"} or file.name == "weights.py"


def test_importing_the_package_loads_its_core_and_numpy_alone() -> None:
    code = (
        "import sys, numpy.random; before = set(sys.modules); import dafnet_addon; assert "
        "callable(dafnet_addon.generate);"
        "print(*sorted(set(sys.modules) - before))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    loaded = done.stdout.split()
    assert {name.split(".")[0] for name in loaded} <= {
        "dafnet_addon",
        "numpy",
        *sys.stdlib_module_names,
    }
    ours = {".".join(name.split(".")[:2]) for name in loaded if name.startswith("dafnet_addon")}
    assert ours == {"dafnet_addon", "dafnet_addon.core"}, "what is not asked for is not loaded"


LAYERS = {
    "core": set(),
    "director": {"core"},
    "model": {"core"},
    "data": {"core", "director"},
    "training": {"core", "data", "model"},
    "baselines": {"core", "data", "model", "training"},
    "demo": {"core"},
    "blender": {"core", "director", "demo"},
    "batch": {"core", "director"},
    "commands": {"core", "batch", "director", "data", "training", "baselines", "blender"},
    "cli": {"core", "commands"},
    "__main__": {"core", "cli"},
    "__init__": {"core"},
}
"""What each package or module of ``dafnet_addon`` may import, those that it stands on."""


def imported_modules(file: Path) -> set[Path]:
    """The files of ``dafnet_addon`` that a file of it imports, also inside functions."""
    found = set()
    for node in ast.walk(tree_of(file)):
        if not isinstance(node, ast.ImportFrom) or not node.level:
            continue
        place = file.parents[node.level - 1].joinpath(*(node.module or "").split("."))
        for target in (place / alias.name for alias in node.names):
            candidates = (target.with_suffix(".py"), target / "__init__.py")
            whole = (place.with_suffix(".py"), place / "__init__.py")
            found |= {next((each for each in (*candidates, *whole) if each.exists()), file)}
    return {each for each in found if each.is_relative_to(PACKAGE)} - {file}


def layer(file: Path) -> str:
    return file.relative_to(PACKAGE).with_suffix("").parts[0]


@pytest.mark.parametrize(
    "file", sources("dafnet_addon"), ids=lambda file: file.relative_to(PACKAGE).as_posix()
)
def test_no_layer_imports_upward(file: Path) -> None:
    above = {layer(each) for each in imported_modules(file)} - {layer(file), "__init__"}
    assert above <= LAYERS[layer(file)]


def test_there_is_no_import_circle() -> None:
    imported = {file: imported_modules(file) for file in sources("dafnet_addon")}
    while leaves := [file for file, others in imported.items() if not others & imported.keys()]:
        for file in leaves:
            del imported[file]
    assert not imported, sorted(file.relative_to(PACKAGE).as_posix() for file in imported)


def numbers(node: ast.expr) -> list[int]:
    """The whole numbers that an index names, alone or in a list."""
    if isinstance(node, ast.Constant) and type(node.value) is int:
        return [node.value]
    return [k for each in node.elts for k in numbers(each)] if isinstance(node, ast.List) else []


@pytest.mark.parametrize(
    "file", sources(*FOLDERS), ids=lambda file: file.relative_to(ROOT).as_posix()
)
def test_joints_go_by_name(file: Path) -> None:
    """``joints[:, HEAD]``, not ``joints[:, 15]``: names are ``core.skeleton``'s."""
    bare = []
    for node in ast.walk(tree_of(file)):
        if not isinstance(node, ast.Subscript):
            continue
        axes = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        array = ast.unparse(node.value).split(".")[-1]
        if array in ("joints", "targets") and len(axes) > 1 and "..." not in ast.unparse(axes[0]):
            bare += [node.lineno] * len(numbers(axes[1]))
        elif array in ("REST", "OFFSETS"):
            bare += [node.lineno] * len(numbers(axes[0]))
    assert not bare or file.name == "skeleton.py"


ONE_PLACE = {
    "core/series.py": (r"3\.0 - 2\.0 \*", r"\* 30(\.0)?\b(?!\.)", r"\bfps(: float)? ?= ?30\b"),
    "core/root.py": (
        r"arctan2\(-\w+(\[\.\.\., 0\]|\[:, 0\]|\[0\])",
        r"\[-np\.sin\([\w.]+\), np\.cos\([\w.]+\)\]",
    ),
}
"""What is written down in one file alone: soft steps, the model's frame rate, headings."""


@pytest.mark.parametrize(
    "file", sources(*FOLDERS), ids=lambda file: file.relative_to(ROOT).as_posix()
)
def test_what_has_one_place_is_not_written_again(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    for place, patterns in ONE_PLACE.items():
        if file != PACKAGE / place:
            assert not [found for each in patterns for found in re.findall(each, text)]
