"""Motion files are read whatever their exporters made of them."""

import numpy as np
import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.data.capture.bvh import read_bvh
from dafnet_addon.data.capture.mocap import read_clips
from dafnet_addon.data.capture.rigs import mapped
from kit.motion_files import (
    MIXAMO,
    walk,
    write_amc,
    write_asf,
    write_bvh,
)


def test_an_amc_goes_with_the_asf_it_is_named_after(tmp_path):
    write_asf(tmp_path / "s.asf")
    write_asf(tmp_path / "s2.asf")
    angles, way = walk(9, "y")
    write_amc(tmp_path / "s2_walk.amc", angles, way)
    assert len(list(read_clips(tmp_path))) == 1
    (tmp_path / "s2_walk.amc").rename(tmp_path / "other.amc")
    with pytest.raises(InputError, match=r"2 \.asf files"):
        list(read_clips(tmp_path))


def test_archives_that_are_no_motion_are_passed_over(tmp_path):
    np.savez(tmp_path / "shape.npz", betas=np.zeros(16))
    np.savez(tmp_path / "pool-000.npz", poses=np.zeros((3, 80, 66)), velocity=np.zeros(3))
    with pytest.raises(InputError, match="no motion files"):
        list(read_clips(tmp_path))


LIBERTIES = {
    "a byte order mark": lambda text: "\ufeff" + text,
    "UTF-16": lambda text: text,
    "Windows' line ends": lambda text: text.replace("\n", "\r\n"),
    "an old Mac's line ends": lambda text: text.replace("\n", "\r"),
    "tabs": lambda text: text.replace(" ", "\t"),
    "blank lines": lambda text: text.replace("\n", "\n\n  \n"),
    "decimal commas": lambda text: text.replace(".", ","),
    "trailing spaces": lambda text: text.replace("\n", "  \n"),
}


"""What a text file may look like without meaning anything else."""


BVH_LIBERTIES = LIBERTIES | {
    "one frame more than announced": lambda text: text.replace("Frames: 12", "Frames: 11"),
    "one frame less than announced": lambda text: text.replace("Frames: 12", "Frames: 13"),
    "no space after the colons": lambda text: text.replace("Frames: ", "Frames:").replace(
        "Time: ", "Time:"
    ),
    "a space before the colons": lambda text: text.replace("Frames:", "Frames :").replace(
        "Time:", "Time :"
    ),
    "capitals": lambda text: text.upper(),
    "small letters": lambda text: text.lower(),
    "end sites with names": lambda text: text.replace("End Site", "End Site LeftTip"),
    "end sites in one word": lambda text: text.replace("End Site", "EndSite"),
    "end sites without a word": lambda text: text.replace("End Site", "End"),
    "end sites without offset": lambda text: text.replace("OFFSET 0 1 0", ""),
    "end sites that say they are still": lambda text: text.replace(
        "OFFSET 0 1 0", "OFFSET 0 1 0 CHANNELS 0"
    ),
    "braces on their names' line": lambda text: text.replace("\n{", "{").replace("Hips", "Hips "),
    "commas between numbers": lambda text: (
        text[: text.index("MOTION")]
        + text[text.index("MOTION") :]
        .replace(" ", ", ")
        .replace("Frames:,", "Frames:")
        .replace("Frame,", "Frame")
        .replace("Time:,", "Time:")
    ),
    "frames over several lines": lambda text: (
        text[: text.index("Time")] + text[text.index("Time") :].replace(" ", "\n")
    ),
    "a prefix with a colon": lambda text: _renamed(text, "mixamorig:"),
    "a prefix with an underscore": lambda text: _renamed(text, "mixamorig1_"),
    "a prefix of its own": lambda text: _renamed(text, "Hero 2 "),
}


def _renamed(text: str, prefix: str) -> str:
    for name in sorted(MIXAMO.values(), key=len, reverse=True):
        text = text.replace(f" {name}\n", f" {prefix}{name}\n")
    return text


@pytest.mark.parametrize("liberty", BVH_LIBERTIES)
def test_a_bvh_is_read_whatever_its_exporter_made_of_it(tmp_path, liberty):
    angles, way = walk(12, "y")
    truth = write_bvh(tmp_path / "a.bvh", angles, way)
    text = (tmp_path / "a.bvh").read_text(encoding="utf-8")
    changed = BVH_LIBERTIES[liberty](text)
    assert changed != text or liberty == "UTF-16"
    (tmp_path / "a.bvh").write_bytes(changed.encode("utf-16" if liberty == "UTF-16" else "utf-8"))
    recording = read_bvh(tmp_path / "a.bvh")
    joints, _ = mapped(recording, tmp_path / "a.bvh")
    assert recording.rate == 30.0 and np.abs(joints * 0.01 - truth).max() < 1e-6
    assert len(list(read_clips(tmp_path))) == 1


@pytest.mark.parametrize("liberty", [*LIBERTIES, "small letters", "capitals"])
def test_acclaim_files_are_read_whatever_was_made_of_them(tmp_path, liberty):
    write_asf(tmp_path / "s.asf")
    angles, way = walk(9, "y")
    write_amc(tmp_path / "s_a.amc", angles, way)
    (before,) = read_clips(tmp_path)
    changes = LIBERTIES | {"small letters": str.lower, "capitals": str.upper}
    for name in ("s.asf", "s_a.amc"):
        text = (tmp_path / name).read_text(encoding="utf-8")
        changed = changes[liberty](text)
        (tmp_path / name).write_bytes(changed.encode("utf-16" if liberty == "UTF-16" else "utf-8"))
        (after,) = read_clips(tmp_path)
        assert np.abs(before.joints - after.joints).max() < 1e-9, name
