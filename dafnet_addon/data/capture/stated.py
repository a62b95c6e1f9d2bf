"""What a ``clips.json`` or ``clips.csv`` (columns ``file`` and the same words) in a folder of
motion files says of them:

    {"*": {"licence": "CC0"},
     "s2/*.bvh": {"subject": "s2", "split": "test", "category": "sit-stand"}}

Names are file names relative to the folder, in which ``*`` stands for any characters and ``?`` for
one; later lines win.
"""

import csv
import json
import os
import re
from io import StringIO
from pathlib import Path, PurePath
from typing import Any
from unicodedata import normalize

from ...core.errors import InputError

__all__ = ["Stated"]

_FIELDS = {"source", "subject", "description", "category", "split", "licence", "fps", "up"}
# nothing, or what else it may be
_FORMS = {"split": "|train|test", "up": "|y|z", "fps": r"|[1-9]\d*(\.\d+)?"}


def _form(name: str) -> str:
    """A name or pattern as any system writes it."""
    return normalize("NFC", name).replace("\\", "/")


def _name(path: PurePath) -> str:
    """A file's name in that form; names on disks are UTF-8, whatever the locale that Python reads
    them in.
    """
    try:
        return _form(os.fsencode(path.as_posix()).decode("utf-8"))
    except UnicodeError:
        return _form(path.as_posix())


def _pattern(name: str) -> re.Pattern[str]:
    """Brackets, which downloads are often numbered with, stand for themselves."""
    wild = {"*": ".*", "?": "."}
    return re.compile(
        "".join(wild.get(c) or re.escape(c) for c in re.sub(r"\*+", "*", _form(name))), re.DOTALL
    )


def _csv_rows(text: str) -> list[tuple[str, dict[str, Any]]]:
    """Raises ValueError or csv.Error where the text is not a table with a column 'file'."""
    heading = text.split("\n", 1)[0]
    table = csv.DictReader(StringIO(text, newline=""), delimiter=max(",;\t", key=heading.count))
    table.fieldnames = [name.strip().lower() for name in table.fieldnames or ()]
    if "file" not in table.fieldnames:
        raise ValueError("it has no column 'file'")

    rows = []
    for row in table:
        filled = {str(k): v.strip() if isinstance(v, str) else str(v) for k, v in row.items() if v}
        given = {k: v for k, v in filled.items() if v}
        if given and "file" not in given:
            raise ValueError(f"no file in line {table.line_num}")
        if given:
            rows.append((given.pop("file"), given))

    return rows


class Stated:
    """Raises InputError where the file cannot be understood, since a licence might be lost."""

    def __init__(self, folder: Path) -> None:
        as_json, as_csv = folder / "clips.json", folder / "clips.csv"
        self.file = as_json if as_json.exists() else as_csv
        rows: list[tuple[str, dict[str, Any]]] = []
        try:
            text = self.file.read_text(encoding="utf-8-sig") if self.file.exists() else ""
            if self.file == as_json:
                rows = [
                    (name, {k: str(v) for k, v in fields.items()})
                    for name, fields in json.loads(text).items()
                ]
            elif text:
                rows = _csv_rows(text)
        except (AttributeError, OSError, RecursionError, ValueError, csv.Error) as error:
            raise InputError(
                f"The file '{self.file}' does not list clips by file name ({error}); write it in "
                "UTF-8 like "
                """{"*.bvh": {"licence": "CC0", "subject": "s1"}}, """
                "or as CSV with a column 'file'."
            ) from None

        for pattern, fields in rows:
            wrong = sorted(set(fields) - _FIELDS)
            wrong += [k for k, form in _FORMS.items() if not re.fullmatch(form, fields.get(k, ""))]
            if wrong:
                raise InputError(
                    f"The file '{self.file}' states for '{pattern}' what cannot be used "
                    f"({', '.join(wrong)}); give any of "
                    f"{', '.join(sorted(_FIELDS))}, with split 'train' or 'test', up 'y' or 'z' "
                    "and fps a number."
                )

        self.rows = [(name, _pattern(name), fields) for name, fields in rows]

    def of(self, path: PurePath) -> dict[str, str]:
        """What is stated of a file, by its path in the folder."""
        name = _name(path)
        fields: dict[str, str] = {}
        for _, pattern, given in self.rows:
            if pattern.fullmatch(name):
                fields |= given
        return fields

    def unmet(self, paths: list[PurePath]) -> list[str]:
        """A sentence for each line that is of none of the files."""
        names = [_name(path) for path in paths]
        return [
            f"The file '{self.file}' states '{name}', which no motion file is called; only * and "
            "? stand for other characters."
            for name, pattern, _ in self.rows
            if not any(map(pattern.fullmatch, names))
        ]
