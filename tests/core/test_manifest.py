"""A shot's manifest: written, read back, and compared with what would be made now."""

from pathlib import Path

import pytest

from dafnet_addon.core import manifest
from dafnet_addon.core.errors import InputError
from dafnet_addon.core.manifest import (
    MANIFEST,
    Manifest,
    content_hash,
    current_version,
    read_manifest,
    words_hash,
)


def made(tmp_path: Path) -> tuple[Manifest, Path]:
    """The manifest of a shot of a room, and the room's file."""
    room = tmp_path / "room.blend"
    room.write_bytes(b"a room")
    shot = Manifest(
        words=words_hash({"room": "room.blend", "takes": 3}),
        seed=7,
        takes=3,
        weights="abc",
        inputs={str(room): content_hash(room)},
        seconds={"reading": 0.5, "generating": 2.0, "of which network": 1.5},
        metrics={"foot_sliding_per_frame": 0.1},
        warnings=("It is dark.",),
        people=({"name": "Ann"},),
    )
    return shot, room


def test_it_is_read_back(tmp_path: Path) -> None:
    shot, _ = made(tmp_path)
    assert read_manifest(tmp_path) is None
    shot.save(tmp_path)
    found = read_manifest(tmp_path)
    assert found is not None and found.version == current_version()
    assert found.all_seconds == 2.5
    assert (found.seed, found.inputs, found.metrics) == (7, shot.inputs, shot.metrics)
    assert list(found.warnings) == ["It is dark."] and found.people[0]["name"] == "Ann"


def test_what_would_change_a_shot_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shot, room = made(tmp_path)
    words = words_hash({"takes": 3, "room": "room.blend"})
    assert shot.what_changed(words, "abc") == ""
    assert shot.what_changed(words_hash({"takes": 4}), "abc") == "other words"
    assert shot.what_changed(words, "abd") == "other weights"
    room.touch()
    assert shot.what_changed(words, "abc") == "", "written again, with the same content"
    room.write_bytes(b"b room")
    assert shot.what_changed(words, "abc") == "'room.blend' has changed"
    room.unlink()
    assert shot.what_changed(words, "abc") == "'room.blend' is gone"
    monkeypatch.setattr(manifest, "current_version", lambda: "9.9.9")
    assert shot.what_changed(words, "abc") == f"made by version {current_version()}"


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"words": 1}', '{"words": "a", "weights": "b", "version": "c"}']
)
def test_what_is_no_manifest_of_ours(tmp_path: Path, text: str) -> None:
    (tmp_path / MANIFEST).write_text(text, encoding="utf-8")
    assert read_manifest(tmp_path) is None


def test_a_folders_content(tmp_path: Path) -> None:
    folder = tmp_path / "pieces"
    (folder / "deeper").mkdir(parents=True)
    (folder / "deeper" / "chair.glb").write_bytes(b"chair")
    before = content_hash(folder)
    (folder / "deeper" / "chair.glb").rename(folder / "chair.glb")
    moved = content_hash(folder)
    (folder / "chair.glb").write_bytes(b"stool")
    assert len({before, moved, content_hash(folder)}) == 3
    with pytest.raises(InputError, match="cannot be read"):
        content_hash(tmp_path / "none")


def test_the_version_is_the_extensions() -> None:
    assert current_version().count(".") == 2
