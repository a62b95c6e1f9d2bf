"""Bad input through every door: the operator and the command say the same sentence, and the scene
stays as it was.

What is in order but strange goes on, with a warning where the result is not what was meant; and
what is none of the animator's faults makes no difference. The core's own refusals are tested in
``test_generate`` and ``test_weights``.
"""

import json
import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon import load_weights
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.armature import metres_per_unit
from bl_ext.user_default.dafnet.dafnet_addon.blender.compat import action_curves
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline import job
from bl_ext.user_default.dafnet.dafnet_addon.cli import main
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError

from kit.stage import Stage, key

Change = Callable[["Shot"], object]

NAN = float("nan")


class Shot(Stage):
    """A character that walks half a metre towards a chair in 12 frames; ``unit``: metres in a
    Blender unit.
    """

    def __init__(self, folder: Path, unit: float = 1.0) -> None:
        super().__init__(height=1.7, frames=(1, 12), unit=unit)
        self.folder = folder
        self.chair = self.seat("Chair", location=(0, 0.9 / unit, 0), scale=(1 / unit,) * 3)
        self.walk((1, 0.0), (12, 0.45 / unit))
        self.scene.frame_set(5)

    def shown(self, *names: str) -> Any:
        """A collection as the view layer sees it."""
        found = bpy.context.view_layer.layer_collection
        for name in names:
            found = found.children[name]
        return found

    def curves(self, made: Any) -> list[Any]:
        return action_curves(made)

    def edit_bones(self, change: Callable[[Any], None]) -> None:
        bpy.ops.object.mode_set(mode="EDIT")
        change(self.ann.data.edit_bones)
        bpy.ops.object.mode_set(mode="OBJECT")

    def refused(self) -> str:
        """The sentence with which *Generate* refuses; nothing has changed by then."""
        before = self.state()
        with pytest.raises(RuntimeError) as caught:
            bpy.ops.dafnet.generate()
        assert self.state() == before
        said = str(caught.value).strip().removeprefix("Error: ")
        assert said.endswith(".") and said.count(". ") == 0 and "\n" not in said
        return said

    def refused_by_poll(self) -> str:
        """What the tooltip of the grey button says; pressing it changes nothing."""
        before = self.state()
        with pytest.raises(RuntimeError, match="poll") as caught:
            bpy.ops.dafnet.generate()
        assert self.state() == before
        return str(caught.value)

    def command(self, capsys: pytest.CaptureFixture[str], *options: str) -> tuple[int, str, str]:
        """Save the scene and bake it with the command: exit code, standard output, last line of
        standard error.
        """
        file = self.folder / "scene.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(file))
        capsys.readouterr()
        arguments = ["bake", str(file), "-o", str(self.folder / "out.blend"), "--json", *options]
        code = main(arguments)
        out, err = capsys.readouterr()
        return code, out, err.strip().splitlines()[-1]

    def heads(self) -> np.ndarray:
        """The bones' heads (12, 22, 3), metres, as Blender plays them."""
        return metres_per_unit(self.scene) * self.played()


@pytest.fixture
def shot(blender: ModuleType, tmp_path: Path) -> Shot:
    return Shot(tmp_path)


def _spoil_key(shot: Shot, made: Any) -> None:
    key(made, "location", (1, tuple(made.location)))
    action_curves(made)[0].keyframe_points[-1].co.y = NAN


def _edited_parent(bones: Any) -> None:
    bones["left_knee"].parent = bones["right_hip"]


def _solo(shot: Shot) -> None:
    bpy.ops.dafnet.generate()
    data = shot.ann.animation_data
    track = data.nla_tracks.new()
    track.strips.new("Take", 1, data.action)
    track.is_solo = True


def _tweaked(shot: Shot) -> None:
    bpy.ops.dafnet.generate()
    data = shot.ann.animation_data
    track = data.nla_tracks.new()
    track.strips.new("Take", 1, data.action).select = True
    data.action = None
    data.nla_tracks.active = track
    data.use_tweak_mode = True


ERRORS: dict[str, tuple[Change, str]] = {
    "empty collection": (
        lambda s: setattr(s.own, "furniture", s.collection("Empty")),
        "'Empty' has no visible mesh",
    ),
    "meshes without faces": (lambda s: s.chair.data.clear_geometry(), "have no faces"),
    "disabled furniture": (lambda s: setattr(s.chair, "hide_viewport", True), "no visible mesh"),
    "the character's own meshes only": (
        lambda s: setattr(s.own, "furniture", bpy.data.collections["Ann"]),
        "no visible mesh besides the character's",
    ),
    "excluded furniture": (
        lambda s: setattr(s.shown("Furniture"), "exclude", True),
        "no visible mesh",
    ),
    "furniture behind a closed eye": (
        lambda s: setattr(s.shown("Furniture"), "hide_viewport", True),
        "no visible mesh",
    ),
    "NaN in the root": (
        lambda s: setattr(s.own.root, "rotation_euler", (0, 0, NAN)),
        "root.*not a number",
    ),
    "NaN in a key of the root": (lambda s: _spoil_key(s, s.own.root), "root.*not a number"),
    "NaN in furniture": (lambda s: setattr(s.chair, "scale", (NAN, 1, 1)), "'Chair'.*not a number"),
    "NaN in a key of furniture": (lambda s: _spoil_key(s, s.chair), "'Chair'.*not a number"),
    "NaN in a vertex": (
        lambda s: setattr(s.chair.data.vertices[0], "co", (NAN, 0, 0)),
        "'Chair'.*not a number",
    ),
    "NaN in a target": (
        lambda s: [
            setattr(s.own, "mode", "EE"),
            setattr(s.own.hand_left, "location", (0, NAN, 0)),
        ],
        "left hand target.*not a number",
    ),
    "root scaled to zero": (
        lambda s: setattr(s.own.root, "scale", (0, 0, 0)),
        "root.*scaled to zero",
    ),
    "reversed range": (
        lambda s: [
            setattr(s.own, *pair)
            for pair in (("use_scene_range", False), ("frame_start", 9), ("frame_end", 8))
        ],
        "before its start",
    ),
    "stretched time": (
        lambda s: setattr(s.scene.render, "frame_map_new", 200),
        "uses time stretching",
    ),
    "the character as its root": (lambda s: setattr(s.own, "root", s.ann), "follows the character"),
    "root on the character": (
        lambda s: setattr(s.own.root, "parent", s.ann),
        "follows the character",
    ),
    "hand on what follows the character": (
        lambda s: [
            setattr(s.own, "mode", "EE"),
            setattr(s.own.hand_left, "parent", s.chair),
            setattr(s.chair.constraints.new("COPY_LOCATION"), "target", s.ann),
        ],
        "left hand target.*follows the character",
    ),
    "uneven scale": (lambda s: setattr(s.ann, "scale", (1, 1, 2)), "scaled unevenly"),
    "bones parented anew": (lambda s: s.edit_bones(_edited_parent), "other parents"),
    "bones that do not inherit": (
        lambda s: setattr(s.ann.data.bones["left_knee"], "use_inherit_rotation", False),
        "other parents or another inheritance",
    ),
    "driven armature": (lambda s: s.ann.driver_add("location", 0), "drivers"),
    "rest position": (lambda s: setattr(s.ann.data, "pose_position", "REST"), "rest position"),
    "NLA solo": (_solo, "solo"),
    "NLA tweak mode": (_tweaked, "tweak"),
}


@pytest.mark.parametrize("case", ERRORS)
def test_errors_are_the_same_sentence_at_both_doors(
    shot: Shot, capsys: pytest.CaptureFixture[str], case: str
) -> None:
    change, words = ERRORS[case]
    change(shot)
    said = shot.refused()
    assert re.search(words, said), said
    code, out, err = shot.command(capsys)
    assert (code, out, err) == (1, "", f"dafnet: {said}")
    assert not (shot.folder / "out.blend").exists()


def test_no_root(shot: Shot, capsys: pytest.CaptureFixture[str]) -> None:
    """The button is grey, so its tooltip says it."""
    shot.own.root = None
    assert "Choose the character's root" in shot.refused_by_poll()
    code, _, err = shot.command(capsys)
    assert code == 1 and "has no root; choose" in err


@pytest.mark.parametrize("active", ["nothing", "the chair"])
def test_whatever_is_active_both_doors_work(
    shot: Shot, capsys: pytest.CaptureFixture[str], active: str
) -> None:
    """The button is the character's until another one is chosen."""
    bpy.context.view_layer.objects.active = {"nothing": None, "the chair": shot.chair}[active]
    assert bpy.ops.dafnet.generate.poll()
    code, out, _ = shot.command(capsys)
    assert code == 0 and json.loads(out)["warnings"] == []


def test_where_the_button_is_grey_the_command_still_works(
    shot: Shot, capsys: pytest.CaptureFixture[str]
) -> None:
    bpy.context.view_layer.objects.active = shot.chair
    bpy.ops.object.mode_set(mode="EDIT")
    assert "Switch to object or pose mode first" in shot.refused_by_poll()
    code, out, _ = shot.command(capsys)
    assert code == 0 and json.loads(out)["warnings"] == []


@pytest.mark.parametrize("override", [False, True])
def test_linked_and_overridden_characters(
    shot: Shot,
    capsys: pytest.CaptureFixture[str],
    override: bool,
) -> None:
    library = str(shot.folder / "library.blend")
    bpy.data.libraries.write(library, {bpy.data.collections["Ann"], shot.furniture})
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(library, link=True) as (_, wanted):
        wanted.collections = ["Ann", "Furniture"]
    shot.scene = bpy.context.scene
    for collection in wanted.collections:
        shot.scene.collection.children.link(collection)
    if override:
        wanted.collections[0].override_hierarchy_create(shot.scene, bpy.context.view_layer)
    shot.ann = next(
        o
        for o in shot.scene.objects
        if o.type == "ARMATURE" and bool(o.override_library) == override
    )
    bpy.context.view_layer.objects.active = shot.ann
    said = shot.refused()
    assert "is linked, or an override that may not be edited; make an editable" in said
    code, _, err = shot.command(capsys, "--character", shot.ann.name_full)
    assert (code, err) == (1, f"dafnet: {said}")


def _shortened(raw: bytes) -> bytes:
    return raw[: len(raw) // 2]


def _of_another_version(raw: bytes) -> bytes:
    return raw.replace(b"dafnet-1", b"dafnet-9", 1)


def _hostile(raw: bytes) -> bytes:
    return (1 << 62).to_bytes(8, "little") + raw[8:]


@pytest.mark.parametrize(
    ("spoilt", "words"),
    [
        (None, "cannot be read"),
        (_shortened, "damaged"),
        (_of_another_version, "another version"),
        (_hostile, "damaged"),
    ],
)
def test_weights_that_cannot_be_used(
    shot: Shot,
    capsys: pytest.CaptureFixture[str],
    spoilt: Callable[[bytes], bytes] | None,
    words: str,
) -> None:
    file = shot.folder / "weights.safetensors"
    if spoilt:
        file.write_bytes(spoilt(load_weights().path.read_bytes()))
    preferences = bpy.context.preferences.addons["bl_ext.user_default.dafnet"].preferences
    preferences.weights = str(file)
    try:
        said = shot.refused()
    finally:
        preferences.weights = ""
    assert words in said and "choose another file" in said
    code, out, err = shot.command(capsys, "--weights", str(file))
    assert (code, out, err) == (1, "", f"dafnet: {said}")


def _delete(shot: Shot, made: Any) -> None:
    """As a user does: what a setting names lives on outside the scene."""
    for each in bpy.context.view_layer.objects:
        each.select_set(each == made)
    bpy.ops.object.delete()


DELETED: dict[str, Callable[[Shot], Any]] = {
    "root": lambda s: s.own.root,
    "armature": lambda s: s.ann,
    "chair": lambda s: s.chair,
    "hand": lambda s: s.own.hand_left,
}


@pytest.mark.parametrize("until", [0.01, 0.5])
@pytest.mark.parametrize("removed", [False, True])
@pytest.mark.parametrize("which", DELETED)
def test_what_is_deleted_while_a_take_is_made(
    shot: Shot, which: str, removed: bool, until: float
) -> None:
    """While the scene is read and while poses are made; deleted in the scene or gone from the
    file.
    """
    made = DELETED[which](shot)
    shot.scene.frame_end = 40
    steps = job.steps(bpy.context, job.settings_of(shot.ann, shot.scene))
    while next(steps) < until:
        pass
    if removed:
        bpy.data.objects.remove(made)
    else:
        _delete(shot, made)
    actions = [action.name for action in bpy.data.actions]
    with pytest.raises(InputError, match="generate again"):
        for _ in steps:
            pass
    assert [action.name for action in bpy.data.actions] == actions and shot.scene.frame_current == 5


def test_the_furniture_collection_is_removed_while_a_take_is_made(shot: Shot) -> None:
    steps = job.steps(bpy.context, job.settings_of(shot.ann, shot.scene))
    while next(steps) < 0.5:
        pass
    bpy.data.collections.remove(shot.furniture)
    with pytest.raises(InputError, match="is no longer in the scene"):
        for _ in steps:
            pass


def _far_targets(shot: Shot) -> None:
    shot.own.mode = "EE"
    for target in (shot.own.head, shot.own.hand_left, shot.own.hand_right):
        target.location = (10, 0, 1)


def _crowd(shot: Shot) -> None:
    shot.chair.location, shot.chair.scale = (0, 0.2, 0), (2.2, 2.2, 4)


def _jump(shot: Shot) -> None:
    for frame, y in ((6, 0.0), (7, 5.0), (12, 5.2)):
        key(shot.root, "location", (frame, (0, y, 0)))


WARNINGS: dict[str, tuple[Change, str]] = {
    "no furniture": (lambda s: setattr(s.own, "furniture", None), "no furniture"),
    "a still root": (lambda s: s.own.root.animation_data_clear(), "does not move"),
    "a tilted root": (
        lambda s: setattr(s.own.root, "rotation_euler", (np.pi / 2, 0, 0)),
        "tilts by up to 90",
    ),
    "a jump of 5 m": (_jump, "jumps"),
    "a room full of furniture": (_crowd, "runs through furniture.*more than the sensor can tell"),
    "targets 10 m away": (_far_targets, "'hand left' is up to 10.*reached for"),
    "a single frame": (lambda s: setattr(s.scene, "frame_end", 1), "only one frame"),
    "furniture scaled to zero": (
        lambda s: setattr(s.chair, "scale", (0, 0, 0)),
        "'Chair' is scaled to zero",
    ),
    "furniture in centimetres": (
        lambda s: setattr(s.chair, "scale", (0.01, 0.01, 0.01)),
        "across: is its unit right",
    ),
    "furniture that grows from nothing": (
        lambda s: key(s.chair, "scale", (1, (0, 0, 0)), (9, (1, 1, 1))),
        "scale of 'Chair' is animated",
    ),
    "bone constraints": (
        lambda s: s.ann.pose.bones["left_knee"].constraints.new("LIMIT_ROTATION"),
        "constraints or drivers",
    ),
    "bone drivers": (
        lambda s: s.ann.pose.bones["left_knee"].driver_add("location", 0),
        "constraints or drivers",
    ),
}


@pytest.mark.parametrize("case", WARNINGS)
def test_warnings_are_the_same_at_both_doors(
    shot: Shot, capsys: pytest.CaptureFixture[str], case: str
) -> None:
    change, words = WARNINGS[case]
    change(shot)
    capsys.readouterr()
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    reported = [
        line.removeprefix("Warning: ")
        for line in capsys.readouterr().out.splitlines()
        if "Warning: " in line
    ]
    assert re.search(words, " ".join(reported)), reported
    assert shot.scene.frame_current == 5
    values = [point.co for curve in action_curves(shot.ann) for point in curve.keyframe_points]
    assert len(values) == (6 + 3 + 22 * 4) * shot.scene.frame_end and np.isfinite(values).all()
    code, out, _ = shot.command(capsys)
    assert code == 0 and json.loads(out)["warnings"] == reported


def _own_things_in_furniture(shot: Shot) -> None:
    for made in (shot.ann, *shot.ann.children, shot.own.root, shot.own.head, shot.own.hand_left):
        shot.furniture.objects.link(made)


def _nested_and_unseen(shot: Shot) -> None:
    for name in ("Excluded", "Closed Eye"):
        shot.seat(name, shot.collection(name, shot.furniture), location=(0.3, 0.3, 0))
    shot.shown("Furniture", "Excluded").exclude = True
    shot.shown("Furniture", "Closed Eye").hide_viewport = True
    shot.seat("Hidden", location=(0.3, 0.3, 0)).hide_set(True)


def _nothing_solid(shot: Shot) -> None:
    shot.mesh("Edges", [(0, 0, 0), (0, 0, 1)], [], edges=[(0, 1)])
    shot.mesh("Nothing", [], [])
    sliver = [(0, 0.5, 0), (0, 0.5, 1), (0, 0.5, 1)]
    shot.mesh("Sliver", sliver, [(0, 1, 2)], location=(9, 9, 0))
    curve = bpy.data.curves.new("Line", "CURVE")
    curve.splines.new("POLY").points.add(3)
    for data in (
        curve,
        bpy.data.lights.new("Lamp", "POINT"),
        bpy.data.volumes.new("Smoke"),
    ):
        shot.put(bpy.data.objects.new(data.name, data))


def _posed_by_hand(shot: Shot) -> None:
    for bone in shot.ann.pose.bones:
        bone.location, bone.scale, bone.rotation_mode = (0.2, 0, 0.1), (2, 1, 1), "XYZ"
    shot.ann.location, shot.ann.rotation_mode = (NAN, 3, 4), "AXIS_ANGLE"


def _nla_below_an_added_action(shot: Shot) -> None:
    bpy.ops.dafnet.generate()
    data = shot.ann.animation_data
    data.nla_tracks.new().strips.new("Take", 1, data.action)
    data.action_blend_type, data.action_influence = "ADD", 0.5


UNHARMED: dict[str, Change] = {
    "the character's own things in the furniture": _own_things_in_furniture,
    "furniture that is not shown": _nested_and_unseen,
    "furniture without any solid": _nothing_solid,
    "a pose by hand": _posed_by_hand,
    "NLA strips and an action that adds": _nla_below_an_added_action,
    "a hidden armature": lambda s: [
        s.ann.hide_set(True),
        setattr(s.shown("Ann"), "hide_viewport", True),
    ],
    "a disabled armature": lambda s: setattr(s.ann, "hide_viewport", True),
    "pose mode": lambda s: bpy.ops.object.mode_set(mode="POSE"),
    "a scaled, mirrored root": lambda s: setattr(s.own.root, "scale", (-3, 0.5, 2)),
    "the root as a hand that is not asked for": lambda s: setattr(s.own, "hand_left", s.own.root),
    "centimetres": lambda s: s.ann.dimensions,
    "a target on another": lambda s: setattr(s.own.head, "parent", s.own.root),
}


def test_what_makes_no_difference(shot: Shot, blender: ModuleType, tmp_path: Path) -> None:
    assert blender.ops.dafnet.generate() == {"FINISHED"}
    expected = shot.heads()
    for case, change in UNHARMED.items():
        blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        other = Shot(tmp_path, unit=0.01 if case == "centimetres" else 1.0)
        change(other)
        result = job.run(blender.context, job.settings_of(other.ann, other.scene))
        other.ann.hide_viewport = False
        assert result.warnings == (), case
        assert np.abs(other.heads() - expected).max() < 1e-4, case


def test_one_empty_for_root_and_hand_crouches(shot: Shot) -> None:
    shot.own.mode, shot.own.hand_left, shot.own.head, shot.own.hand_right = (
        "EE",
        shot.own.root,
        None,
        None,
    )
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    heads = shot.heads()
    assert np.isfinite(heads).all() and heads[..., 0, 2].min() > 0.2


def test_whatever_becomes_a_mesh_is_read_and_moves(shot: Shot) -> None:
    """Curves with a bevel, text, metaballs, surfaces."""
    data = bpy.data
    text = data.curves.new("Text", "FONT")
    text.body, text.extrude = "Sofa", 0.1
    balls = data.metaballs.new("Balls")
    balls.elements.new()
    rail = data.curves.new("Rail", "CURVE")
    rail.bevel_depth = 0.1
    rail.splines.new("POLY").points.add(1)
    rail.splines[0].points[1].co = (2, 0, 0, 1)
    for made in (text, balls, rail):
        thing = shot.put(bpy.data.objects.new(made.name, made))
        key(thing, "location", (1, (0, 5, 0)), (12, (3, 5, 0)))
    read = shot.read()
    solids = {solid.name: solid for solid in read.scene.solids}
    assert set(solids) == {"Chair", "Text", "Balls", "Rail"}
    for name in ("Text", "Balls", "Rail"):
        assert len(solids[name].triangles) and solids[name].matrix[[0, 11], 0, 3] == pytest.approx(
            [0, 3], abs=1e-5
        )


@pytest.mark.parametrize(
    ("output", "words"),
    [("{tmp}/file/out.blend", "file' is not a folder"), ("{tmp}/folder.blend", "is a folder")],
)
def test_an_output_that_cannot_be_written(
    shot: Shot,
    capsys: pytest.CaptureFixture[str],
    output: str,
    words: str,
) -> None:
    (shot.folder / "file").write_text("in the way", encoding="utf-8")
    (shot.folder / "folder.blend").mkdir()
    code, out, err = shot.command(capsys, "-o", output.format(tmp=shot.folder))
    assert code == 1 and out == "" and words in err and err.startswith("dafnet: ")
