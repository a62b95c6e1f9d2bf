#!/usr/bin/env python3
"""Prepares a release in build/release: the extension's zip, its checksum, what it consists of, and
what has changed. Sets no tag and sends nothing anywhere.

    scripts/release.py                      of the version that the manifest says
    scripts/release.py 0.2.0                sets the version first, and cuts the changelog
    scripts/release.py --website ADDRESS    writes the project's address into the manifest first

Python is the one that runs it, and needs the module bpy, whose builder makes the zip.
"""

import argparse
import datetime
import json
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from hashlib import sha256
from pathlib import Path
from typing import Any

ROOT = Path(__file__).absolute().parents[1]
WEIGHTS = "weights_stub/dafnet.safetensors"
OURS = {".py", ".toml", ".json", ".md", ".html", ".png", ".safetensors", ""}
"""Ends of the names that the zip consists of: sources, tables, pages, pictures, weights, LICENSE.
"""

VERSIONED = {
    "blender_manifest.toml": r'(?m)^version = "(.*)"$',
    "pyproject.toml": r'(?m)^version = "(.*)"$',
    "CITATION.cff": r"(?m)^version: (.*)$",
}
"""The files that say the version, and where."""


def current(folder: Path) -> str:
    """The version that a checkout's manifest says."""
    text = (folder / "blender_manifest.toml").read_text(encoding="utf-8")
    return str(tomllib.loads(text)["version"])


def cut(folder: Path, version: str, day: datetime.date) -> None:
    """Set the version in all files that say it, and make the changelog's unreleased part its own.

    Raises ValueError, and changes nothing, where the version is none, is not later than the one
    that the manifest says or was released, and where nothing is unreleased.
    """
    if not re.fullmatch(r"\d+\.\d+\.\d+", version):
        raise ValueError(f"'{version}' is not a version; write it as 0.2.0.")
    changes = (folder / "CHANGELOG.md").read_text(encoding="utf-8")
    if f"\n## {version} (2" in changes:
        raise ValueError(f"Version {version} was released; name a later one.")
    cut_changes, found = re.subn(
        r"(?m)^## .*\(unreleased\)$", f"## {version} ({day.isoformat()})", changes, count=1
    )
    if not found:
        raise ValueError("The changelog has no part that is '(unreleased)'; write one.")

    texts = {folder / "CHANGELOG.md": cut_changes}
    for name, pattern in VERSIONED.items():
        text = (folder / name).read_text(encoding="utf-8")
        place = re.search(pattern, text)
        if place is None:
            raise ValueError(f"{name} says no version; write one.")
        if _parts(place[1]) > _parts(version):
            raise ValueError(f"{name} says {place[1]} already; name a later version.")
        texts[folder / name] = text[: place.start(1)] + version + text[place.end(1) :]
    for file, text in texts.items():
        file.write_text(text, encoding="utf-8")


def _parts(version: str) -> list[int]:
    return [int(each) for each in version.split(".")]


def with_website(folder: Path, address: str) -> None:
    """Write the project's address into the manifest."""
    file = folder / "blender_manifest.toml"
    text = re.sub(r'(?m)^website = ".*"\n', "", file.read_text(encoding="utf-8"))
    line = f"website = {json.dumps(address)}\n"
    file.write_text(re.sub(r"(?m)^(maintainer = .*\n)", rf"\1{line}", text), encoding="utf-8")


def changes_of(folder: Path, version: str) -> str:
    """The changelog's part of a version. Raises ValueError where it has none that was cut."""
    changes = (folder / "CHANGELOG.md").read_text(encoding="utf-8")
    found = re.search(rf"(?ms)^## {re.escape(version)} \(2[\d-]*\)\n+(.*?)(?=^## |\Z)", changes)
    if found is None:
        raise ValueError(
            f"The changelog has no part of {version} with a date; cut it: "
            f"make release VERSION={version}."
        )
    return found[1]


def parts_list(zipped: Path) -> dict[str, Any]:
    """What a zip consists of, as CycloneDX 1.6: the add-on and its weights, with licences and
    hashes.

    It has no dependency of others inside. Raises ValueError where something lies in it that may be
    one: a wheel, a library, a program.
    """
    with zipfile.ZipFile(zipped) as archive:
        names = [name for name in archive.namelist() if not name.endswith("/")]
        if strange := [name for name in names if Path(name).suffix not in OURS]:
            raise ValueError(f"'{strange[0]}' is in the zip and is not known to be ours.")
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode("utf-8"))
        weights = archive.read(WEIGHTS)

    header = json.loads(weights[8 : 8 + int.from_bytes(weights[:8], "little")])
    code, of_weights = (each.removeprefix("SPDX:") for each in manifest["license"])
    if not header["__metadata__"]["licence"].startswith(of_weights):
        raise ValueError("The manifest and the weights file say different licences of the weights.")

    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application",
                "bom-ref": manifest["id"],
                "name": manifest["id"],
                "version": manifest["version"],
                "description": manifest["tagline"],
                "supplier": {"name": manifest["maintainer"]},
                "licenses": [{"license": {"id": code}}],
                "copyright": ", ".join(manifest["copyright"]),
                "hashes": [{"alg": "SHA-256", "content": sha256(zipped.read_bytes()).hexdigest()}],
            }
        },
        "components": [
            {
                "type": "machine-learning-model",
                "bom-ref": "weights",
                "name": WEIGHTS,
                "description": "Provenance: LICENSE-WEIGHTS.md",
                "licenses": [{"license": {"id": of_weights}}],
                "hashes": [{"alg": "SHA-256", "content": sha256(weights).hexdigest()}],
            }
        ],
        "dependencies": [
            {"ref": manifest["id"], "dependsOn": ["weights"]},
            {"ref": "weights", "dependsOn": []},
        ],
    }


def release(folder: Path, python: str) -> Path:
    """Build the release of a checkout into its build/release, anew."""
    version = current(folder)
    changes = changes_of(folder, version)
    subprocess.run([folder / "scripts" / "build_zip.sh", python], check=True)

    built = folder / "build" / f"dafnet-{version}.zip"
    output = folder / "build" / "release"
    shutil.rmtree(output, ignore_errors=True)
    output.mkdir()
    parts = parts_list(built)
    zipped = Path(shutil.copy(built, output))
    digest = sha256(zipped.read_bytes()).hexdigest()
    files = {
        f"{zipped.name}.sha256": f"{digest}  {zipped.name}\n",
        f"dafnet-{version}.cdx.json": json.dumps(parts, indent=2) + "\n",
        "CHANGES.md": changes,
    }
    for name, text in files.items():
        (output / name).write_text(text, encoding="utf-8", newline="\n")
    return output


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("version", nargs="?", help="cut this one; else the manifest's is built")
    parser.add_argument("--website", metavar="ADDRESS", help="where the project is to be found")
    options = parser.parse_args()
    try:
        if options.version:
            cut(ROOT, options.version, datetime.date.today())
        if options.website:
            with_website(ROOT, options.website)
        output = release(ROOT, sys.executable)
    except ValueError as error:
        sys.exit(f"release: {error}")
    print(*sorted(output.iterdir()), sep="\n")


if __name__ == "__main__":
    main()
