"""Reads furniture libraries: real pieces at true size, and whose they are.

A library is a folder, in which any of these may lie, in subfolders as well:

- the compact form: an ``index.json`` that lists pieces, and ``NAME.npz`` with their ``vertices``
  and ``triangles``;
- Sweet Home 3D's libraries (``.sh3f``): archives of OBJ models with a catalogue of their sizes;
- loose meshes (``.obj``, ``.glb``, ``.gltf``, ``.ply``, ``.stl``), of which a ``pieces.json`` says
  what nobody can find out:

    {"*": {"licence": "CC0-1.0", "maker": "anna"}, "high*.obj": {"kind": "stool", "unit": 0.01,
    "up": "z"}}

Names are file names or patterns relative to the folder; later lines win. A piece whose licence
nobody states is left out, and so is what no word says the kind of.
"""

import io
import json
import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from ...core.errors import InputError

__all__ = ["KINDS", "Piece", "read_library"]

KINDS = {
    "armchair": "armchair lounge deck wheelchair recliner ottoman",
    "toilet": "toilet toilets",
    "sofa": "sofa couch settee",
    "stool": "stool",
    "bench": "bench",
    "chair": "chair seat",
    "bed": "bed bunk",
    "desk": "desk",
    "table": "table counter nightstand",
    "board": "board blackboard whiteboard easel",
    "shelf": "shelf shelves bookcase cabinet wardrobe dresser cupboard chest sideboard buffet",
}
"""Kinds of furniture, and the words of a title that tell them; the first kind that has one counts.
"""

_LOOSE = {".obj", ".glb", ".gltf", ".ply", ".stl"}
_TRUE_TO_SIZE = {".glb", ".gltf"}  # the format's unit is the metre
_STATED = {"kind", "maker", "licence", "title", "unit", "up"}
_CATALOGUE = "PluginFurnitureCatalog.properties"
_LARGEST = 200 << 20  # bytes of one file in an archive
# y up, the front to +z
_SH3F_TO_OURS = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
_COMPACT_TEXTS = ("name", "kind", "title", "library", "licence", "creator")


@dataclass(frozen=True)
class Piece:
    """One piece of furniture at true size: ``vertices`` (V, 3), ``triangles`` (F, 3); metres, z up,
    the floor at z = 0.

    ``kind`` is one of ``KINDS``. ``maker`` made it, ``source`` is the library that it came from,
    ``licence`` what it may be used under.
    """

    name: str
    kind: str
    title: str
    maker: str
    source: str
    licence: str
    vertices: np.ndarray
    triangles: np.ndarray


def read_library(folder: Path) -> tuple[list[Piece], list[str]]:
    """All pieces of a library, and a sentence about each that had to be left out. Needs trimesh for
    what is not compact.

    Raises InputError where the folder holds no furniture that can be used.
    """
    folder = Path(folder)
    pieces: list[Piece] = []
    left_out: list[str] = []
    for found in _found(folder):
        if isinstance(found, Piece):
            pieces.append(found)
        else:
            left_out.append(found)

    if not pieces:
        why = f" ({left_out[0]})" if left_out else ""
        raise InputError(
            f"The folder '{folder}' holds no furniture that can be used{why}; give one with .sh3f "
            "libraries, an index.json, or "
            "meshes and a pieces.json that states their licence."
        )

    return pieces, left_out


def _found(folder: Path) -> Iterator[Piece | str]:
    files = sorted(
        file for file in folder.rglob("*") if file.is_file() and not file.name.startswith("._")
    )
    indices = [file for file in files if file.name == "index.json"]
    for index in indices:
        yield from _compact(index)
    for file in files:
        if file.suffix.lower() == ".sh3f":
            yield from _sweet_home(file)

    stated = _stated(folder)
    for file in files:
        if file.suffix.lower() in _LOOSE:
            yield _loose(folder, file, stated)


def kind_of(text: str) -> str:
    """The kind of furniture that the words of a name or title tell, "" if none does."""
    words = set(re.findall(r"[a-z]+", text.lower()))
    return next((kind for kind, telling in KINDS.items() if words & set(telling.split())), "")


def _checked(piece: Piece) -> Piece | str:
    """The piece, or why it cannot be used."""
    name = f"'{piece.name}' of '{piece.source}'"
    if piece.kind not in KINDS:
        return f"{name} is of no known kind ({', '.join(KINDS)})"
    if not piece.licence:
        return f"{name} states no licence"

    vertices, triangles = piece.vertices, piece.triangles
    if (
        vertices.ndim != 2
        or vertices.shape[1] != 3
        or triangles.ndim != 2
        or triangles.shape[1] != 3
        or not len(triangles)
    ):
        return f"{name} has no triangles"

    if not np.isfinite(vertices).all() or triangles.min() < 0 or triangles.max() >= len(vertices):
        return f"{name} has a coordinate that is not a number, or a triangle of a missing vertex"

    size = np.ptp(vertices, axis=0)
    if not 0.1 < size.max() < 10.0:
        return f"{name} is {size.max():.2g} m large; is its unit right?"

    return piece


def _compact(index: Path) -> Iterator[Piece | str]:
    try:
        rows = json.loads(index.read_text(encoding="utf-8"))["pieces"]
        known = [{text: str(row[text]) for text in _COMPACT_TEXTS} for row in rows]
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"The index '{index}' does not list pieces ({error!r}); each needs "
            f"{', '.join(_COMPACT_TEXTS)}."
        ) from None

    for row in known:
        file = index.with_name(f"{PurePosixPath(row['name']).name}.npz")
        try:
            with np.load(file) as arrays:
                vertices, triangles = (
                    arrays["vertices"].astype(float),
                    arrays["triangles"].astype(np.int64),
                )
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            yield f"'{file.name}' cannot be read ({error})"
            continue
        yield _checked(
            Piece(
                name=row["name"],
                kind=row["kind"],
                title=row["title"],
                maker=row["creator"],
                source=row["library"],
                licence=row["licence"],
                vertices=vertices,
                triangles=triangles,
            )
        )


def _catalogue(text: str) -> tuple[dict[str, str], dict[int, dict[str, str]]]:
    """What a catalogue says of itself, and of each piece by its number."""
    own: dict[str, str] = {}
    pieces: dict[int, dict[str, str]] = {}
    for line in text.splitlines():
        key, found, value = line.partition("=")
        if not found or key.lstrip().startswith(("#", "!")):
            continue

        name, numbered, number = key.strip().partition("#")
        if numbered and number.isdigit():
            pieces.setdefault(int(number), {})[name] = value.strip()
        elif not numbered:
            own[name] = value.strip()

    return own, pieces


def _sweet_home(file: Path) -> Iterator[Piece | str]:
    """The pieces of a ``.sh3f`` library whose titles tell what they are."""
    try:
        with zipfile.ZipFile(file) as archive:
            own, rows = _catalogue(archive.read(_CATALOGUE).decode("latin-1"))
            for number, row in sorted(rows.items()):
                kind = kind_of(row.get("name", ""))
                if kind:
                    yield _of_catalogue(archive, file, own, row, kind, number)
    except (OSError, KeyError, zipfile.BadZipFile) as error:
        raise InputError(
            f"The library '{file}' cannot be read ({error}); download it again."
        ) from None


def _of_catalogue(
    archive: zipfile.ZipFile,
    file: Path,
    own: dict[str, str],
    row: dict[str, str],
    kind: str,
    number: int,
) -> Piece | str:
    """One piece of a Sweet Home 3D library: its model turned, then stretched to the size that the
    catalogue states in cm.
    """
    title = row["name"]
    try:
        size = np.array([float(row[side]) for side in ("width", "depth", "height")]) / 100.0
        turn = np.array(row.get("modelRotation", "1 0 0 0 1 0 0 0 1").split(), float).reshape(3, 3)
        model = row["model"].lstrip("/")
        if not model.lower().endswith(".obj"):
            return f"'{title}' of '{file.name}' is not an OBJ model"
        if archive.getinfo(model).file_size > _LARGEST:
            return f"'{title}' of '{file.name}' is larger than {_LARGEST >> 20} MB"

        vertices, triangles = _mesh_of(io.BytesIO(archive.read(model)), ".obj")
    except (KeyError, ValueError, IndexError) as error:
        return f"'{title}' of '{file.name}' cannot be read ({error})"

    vertices = vertices @ turn.T @ _SH3F_TO_OURS.T
    low, extent = vertices.min(0), np.maximum(np.ptp(vertices, axis=0), 1e-9)
    vertices = (vertices - low) / extent * size - (0.5 * size[0], 0.5 * size[1], 0.0)
    vertices[:, 2] += float(row.get("elevation", 0.0)) / 100.0
    return _checked(
        Piece(
            name=f"{file.stem}/{number}",
            kind=kind,
            title=title,
            maker=row.get("creator", own.get("provider", file.stem)),
            source=file.stem,
            licence=row.get("license", own.get("license", "")),
            vertices=vertices,
            triangles=triangles,
        )
    )


def _stated(folder: Path) -> list[tuple[str, dict[str, Any]]]:
    """What ``pieces.json`` states: patterns of file names, with the fields given for them, in
    order.
    """
    file = folder / "pieces.json"
    if not file.exists():
        return []

    try:
        rows = [
            (str(pattern), dict(fields))
            for pattern, fields in json.loads(file.read_text(encoding="utf-8")).items()
        ]
    except (ValueError, AttributeError, TypeError) as error:
        raise InputError(
            f"The file '{file}' does not list pieces by file name ({error})."
        ) from None

    for pattern, fields in rows:
        if wrong := sorted(set(fields) - _STATED):
            raise InputError(
                f"The file '{file}' states for '{pattern}' what cannot be used "
                f"({', '.join(wrong)})."
            )

    return rows


def _loose(folder: Path, file: Path, stated: list[tuple[str, dict[str, Any]]]) -> Piece | str:
    """A mesh in a file of its own."""
    path = file.relative_to(folder)
    fields: dict[str, Any] = {}
    for pattern, given in stated:
        if path.as_posix() == pattern or fnmatch(path.as_posix(), pattern):
            fields |= given

    if not fields.get("licence"):
        return f"'{path}' states no licence"

    try:
        vertices, triangles = _mesh_of(io.BytesIO(file.read_bytes()), file.suffix.lower())
    except (ValueError, KeyError, IndexError) as error:
        return f"'{path}' cannot be read ({error})"

    if fields.get("up", "y") != "z":
        vertices = vertices @ _SH3F_TO_OURS.T

    unit = 1.0 if file.suffix.lower() in _TRUE_TO_SIZE else float(fields.get("unit", 1.0))
    vertices = vertices * unit
    vertices[:, 2] -= vertices[:, 2].min()
    title = str(fields.get("title", file.stem))
    return _checked(
        Piece(
            name=path.with_suffix("").as_posix(),
            kind=str(fields.get("kind", kind_of(title))),
            title=title,
            maker=str(fields.get("maker", folder.resolve().name)),
            source=folder.resolve().name,
            licence=str(fields["licence"]),
            vertices=vertices,
            triangles=triangles,
        )
    )


def _mesh_of(file: io.BytesIO, suffix: str) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and triangles (F, 3) of a mesh file; ValueError where it holds none."""
    import trimesh

    loaded = trimesh.load(
        file, file_type=suffix[1:], force="mesh", process=False, skip_materials=True
    )
    if not isinstance(loaded, trimesh.Trimesh) or not len(loaded.faces):
        raise ValueError("it holds no triangles")
    return np.asarray(loaded.vertices, float), np.asarray(loaded.faces, np.int64)
