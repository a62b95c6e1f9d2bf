"""What the site has besides docs: pages from elsewhere in the repository, and reference pages made
from docstrings. A hook of MkDocs (mkdocs.yml).

Sources are read, not imported, but for the command's parser, which needs NumPy; Blender is never
needed.
"""

import argparse
import ast
import itertools
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).absolute().parents[1]
DOCS = ROOT / "docs"

ELSEWHERE = {
    "weights.md": "weights_stub/README.md",
    "weights-licence.md": "LICENSE-WEIGHTS.md",
    "farm.md": "farm/README.md",
    "farm-openjd.md": "farm/openjd/README.md",
    "farm-flamenco.md": "farm/flamenco/README.md",
    "contributing.md": "CONTRIBUTING.md",
    "changes.md": "CHANGELOG.md",
}
"""Pages of the site that lie outside docs, by their file."""

_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")
_REFERENCE = ("python", "command", "operators")


def on_files(files: Any, config: Any) -> Any:
    """Add the pages that docs does not hold."""
    from mkdocs.structure.files import File

    made = {name: (ROOT / source).read_text(encoding="utf-8") for name, source in ELSEWHERE.items()}
    made |= {f"reference/{name}.md": REFERENCE[name]() for name in _REFERENCE}
    for name, text in made.items():
        files.append(File.generated(config, name, content=text))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Lead links of the repository to pages of the site; what the site lacks becomes a name."""
    del config
    name = page.file.src_uri
    source = ROOT / ELSEWHERE[name] if name in ELSEWHERE else DOCS / name
    there = {file.src_uri for file in files if file.inclusion.is_included()}
    return for_the_site(markdown, source, name, there)


def for_the_site(markdown: str, source: Path, name: str, there: set[str]) -> str:
    """The text of ``source`` as the site's page ``name``, among the files ``there``."""
    pages = {(ROOT / file).resolve(): page for page, file in ELSEWHERE.items()}

    def led(match: re.Match[str]) -> str:
        picture, words, target = match.groups()
        path, _, anchor = target.partition("#")
        if not path or "://" in target or target.startswith("mailto:"):
            return match[0]
        file = Path(os.path.normpath(source.parent / path))
        page = pages.get(file.resolve())
        if page is None and file.is_relative_to(DOCS):
            page = file.relative_to(DOCS).as_posix()
        if page == "" or page not in there:
            return (
                words
                if words.startswith("`")
                else f"{words} (`{file.relative_to(ROOT).as_posix()}`)"
            )
        way = os.path.relpath(page, os.path.dirname(name) or ".").replace(os.sep, "/")
        return f"{picture}[{words}]({way}{'#' + anchor if anchor else ''})"

    return _LINK.sub(led, markdown)


def _operators() -> str:
    """Every operator by its label: what it does, what it is called in Python, and its options."""
    lines = [
        "# Operators",
        "",
        "What the buttons do, by their names, and how they are called from Python. They work on",
        "the selected character and its settings; an error comes as `RuntimeError` with the",
        "sentence that the interface shows.",
        "",
    ]
    found = []
    for file in sorted((ROOT / "operators").glob("*.py")):
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and (fields := _fields(node)).get("bl_idname"):
                found.append(
                    (fields["bl_label"], fields["bl_idname"], _words(node), _options(node))
                )
    for label, name, words, options in sorted(found):
        lines += [f"## {label}", "", f"`bpy.ops.{name}()`", "", f"{words}.", ""]
        if options:
            lines += ["| option | |", "|---|---|"]
            lines += [f"| `{option}` | {what} |" for option, what in options]
            lines.append("")
    return "\n".join(lines)


def _fields(node: ast.ClassDef) -> dict[str, str]:
    return {
        ast.unparse(each.targets[0]): str(each.value.value)
        for each in node.body
        if isinstance(each, ast.Assign) and isinstance(each.value, ast.Constant)
    }


def _words(node: ast.AST) -> str:
    assert isinstance(node, ast.ClassDef | ast.FunctionDef | ast.Module)
    return re.sub(r"\s+", " ", ast.get_docstring(node) or "").strip().rstrip(".")


def _options(node: ast.ClassDef) -> list[tuple[str, str]]:
    """An operator's properties with their descriptions."""
    found = []
    for each in node.body:
        if not isinstance(each, ast.AnnAssign) or not isinstance(each.annotation, ast.Call):
            continue
        given = {keyword.arg: keyword.value for keyword in each.annotation.keywords}
        words = [given[key] for key in ("description", "name") if key in given]
        said = [str(word.value) for word in words if isinstance(word, ast.Constant)]
        found.append((ast.unparse(each.target), said[0] if said else ""))
    return found


_MODULES = (
    ("core/generate.py", "Generating"),
    ("core/take.py", "What is asked for, and what comes out"),
    ("core/solids.py", "Furniture"),
    ("core/cleanup.py", "Clean-up"),
    ("core/weights.py", "Weights"),
    ("core/paths.py", "Root paths"),
    ("director/tasks.py", "Tasks"),
    ("director/planner.py", "From tasks to paths and targets"),
    ("director/seats.py", "Where one sits"),
    ("director/walks.py", "The way to a seat"),
    ("core/metrics.py", "Metrics"),
    ("batch/lists.py", "Lists of shots"),
    ("batch/running.py", "Batches"),
    ("core/manifest.py", "What a shot was made of"),
    ("core/errors.py", "Errors"),
)
"""The modules of the Python reference, in the order of reading."""


def _python() -> str:
    """What the modules offer (their ``__all__``), with signatures and docstrings."""
    lines = [
        "# Python",
        "",
        "What `dafnet_addon` offers without Blender: NumPy alone. World: right-handed, z up,",
        "metres; the root: x right, y forward.",
        "Inside Blender the same modules are `bl_ext.user_default.dafnet.dafnet_addon.…`.",
        "",
    ]
    for path, title in _MODULES:
        tree = ast.parse((ROOT / "dafnet_addon" / path).read_text(encoding="utf-8"))
        module = "dafnet_addon." + path.removesuffix(".py").replace("/", ".")
        lines += [f"## {title}", "", f"`{module}`", "", _paragraphs(tree), ""]
        public = _public(tree)
        for node in tree.body:
            if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name in public:
                lines += [f"### {node.name}", "", "```python", _signature(node), "```", ""]
                lines += [_paragraphs(node), ""]
        lines += _values(tree, public)
    return "\n".join(lines)


def _values(tree: ast.Module, public: set[str]) -> Iterator[str]:
    """What a module offers besides classes and functions, with what is said below it."""
    for node, below in itertools.pairwise([*tree.body, ast.Pass()]):
        targets = node.targets if isinstance(node, ast.Assign) else []
        for name in {ast.unparse(each) for each in targets} & public:
            said = ""
            if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
                said = re.sub(r"\s+", " ", str(below.value.value))
            value = ast.unparse(node.value)  # type: ignore[union-attr]
            yield f"### {name}\n\n```python\n{name} = {value}\n```\n\n{said}\n"


def _public(tree: ast.Module) -> set[str]:
    for node in tree.body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return set(ast.literal_eval(node.value))
    return set()


def _paragraphs(node: ast.AST) -> str:
    """A docstring as Markdown; its examples as code."""
    assert isinstance(node, ast.ClassDef | ast.FunctionDef | ast.Module)
    said = []
    for block in (ast.get_docstring(node) or "").split("\n\n"):
        if block.startswith(">>>"):
            said.append(f"```pycon\n{block}\n```")
        else:
            said.append(re.sub(r"``([^`]+)``", r"`\1`", block))
    return "\n\n".join(said)


def _signature(node: ast.ClassDef | ast.FunctionDef) -> str:
    """A function's head, a class's fields and methods."""
    if isinstance(node, ast.FunctionDef):
        returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
        return f"def {node.name}({ast.unparse(node.args)}){returns}"
    inside = list(_members(node))
    bases = f"({', '.join(map(ast.unparse, node.bases))})" if node.bases else ""
    return "\n".join([f"class {node.name}{bases}:", *(f"    {each}" for each in inside or ["..."])])


def _members(node: ast.ClassDef) -> Iterator[str]:
    for each in node.body:
        if isinstance(each, ast.AnnAssign) and not ast.unparse(each.target).startswith("_"):
            default = f" = {ast.unparse(each.value)}" if each.value is not None else ""
            yield f"{ast.unparse(each.target)}: {ast.unparse(each.annotation)}{default}"
        elif isinstance(each, ast.FunctionDef) and not each.name.startswith("_"):
            yield from (f"@{ast.unparse(mark)}" for mark in each.decorator_list)
            yield _signature(each)


def _command() -> str:
    """The command's help, word by word, as its own parser gives it."""
    sys.path.insert(0, str(ROOT))
    from dafnet_addon.commands import COMMANDS

    lines = [
        "# The command dafnet",
        "",
        "`python -m dafnet_addon …` in a checkout, or inside Blender, with what the extension has",
        "of it: `blender scene.blend --command dafnet …`. All take `--json`. Exit codes: 0 done, 1",
        "an error told in one sentence, 2 a wrong command line, 130 stopped.",
        "",
    ]
    for command in COMMANDS:
        parser = argparse.ArgumentParser(f"dafnet {command.name}", description=command.summary)
        parser.set_defaults(in_blender=False)
        command.add_arguments(parser)
        parser.formatter_class = _Wide
        lines += [f"## {command.name}", "", "```text", parser.format_help().rstrip(), "```", ""]
    return "\n".join(lines)


class _Wide(argparse.HelpFormatter):
    def __init__(self, prog: str) -> None:
        super().__init__(prog, width=100)


REFERENCE = {"python": _python, "command": _command, "operators": _operators}
"""The pages that are made of sources."""
