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

import numpy as np
import pytest

Change = Callable[["Shot"], object]

CORNERS = [(x, y, z) for x in (-0.25, 0.25) for y in (-0.25, 0.25) for z in (0.0, 0.45)]
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
NAN = float("nan")


class Shot:
    """A character that walks half a metre towards a chair in 12 frames; ``unit``: metres in a
    Blender unit.
    """

    def __init__(
        self, bpy: ModuleType, addon: Callable[[str], Any], tmp_path: Path, unit: float = 1.0
    ) -> None:
        self.bpy, self.addon, self.tmp_path = bpy, addon, tmp_path
        self.scene = bpy.context.scene
        self.scene.unit_settings.scale_length = unit
        self.scene.frame_end = 12
        self.ann = addon("dafnet_addon.blender.armature").create_character(bpy.context, "Ann", 1.7)
        self.own = self.ann.dafnet
        self.own.furniture = self.furniture = self.collection("Furniture", self.scene.collection)
        self.chair = self.mesh("Chair", location=(0, 0.9 / unit, 0), scale=(1 / unit,) * 3)
        for frame, y in ((1, 0.0), (12, 0.45 / unit)):
            self.key(self.own.root, frame, location=(0, y, 0))
        self.scene.frame_set(5)

    def put(self, name: str, data: Any = None, **properties: Any) -> Any:
        made = self.bpy.data.objects.new(name, data)
        for key, value in properties.items():
            setattr(made, key, value)
        self.furniture.objects.link(made)
        return made

    def mesh(self, name: str, corners=CORNERS, edges=(), faces=FACES, **properties: Any) -> Any:
        made = self.bpy.data.meshes.new(name)
        made.from_pydata(corners, edges, faces)
        return self.put(name, made, **properties)

    def collection(self, name: str, parent: Any = None) -> Any:
        made = self.bpy.data.collections.new(name)
        if parent:
            parent.children.link(made)
        return made

    def key(self, made: Any, frame: int, **properties: Any) -> None:
        for path, value in properties.items():
            setattr(made, path, value)
            made.keyframe_insert(path, frame=frame)

    def shown(self, *names: str) -> Any:
        """A collection as the view layer sees it."""
        found = self.bpy.context.view_layer.layer_collection
        for name in names:
            found = found.children[name]
        return found

    def curves(self, made: Any) -> list[Any]:
        return self.addon("dafnet_addon.blender.compat").action_curves(made)

    def edit_bones(self, change: Callable[[Any], None]) -> None:
        self.bpy.ops.object.mode_set(mode="EDIT")
        change(self.ann.data.edit_bones)
        self.bpy.ops.object.mode_set(mode="OBJECT")

    def state(self) -> dict[str, object]:
        """What must not change when something fails."""
        data, layer = self.bpy.data, self.bpy.context.view_layer
        layer.update()
        return {
            "data": [
                sorted(b.name for b in kind)
                for kind in (data.actions, data.objects, data.meshes, data.curves)
            ],
            "keys": {
                o.name: [len(c.keyframe_points) for c in self.curves(o)] for o in data.objects
            },
            "frame": (self.scene.frame_current, self.scene.frame_subframe),
            "selected": (
                sorted(o.name for o in layer.objects.selected),
                layer.objects.active,
                self.bpy.context.mode,
            ),
            "places": repr([[tuple(row) for row in o.matrix_world] for o in data.objects]),
            "pose": repr(
                [tuple(v for row in b.matrix_basis for v in row) for b in self.ann.pose.bones]
            ),
        }

    def refused(self) -> str:
        """The sentence with which *Generate* refuses; nothing has changed by then."""
        before = self.state()
        with pytest.raises(RuntimeError) as caught:
            self.bpy.ops.dafnet.generate()
        assert self.state() == before
        said = str(caught.value).strip().removeprefix("Error: ")
        assert said.endswith(".") and said.count(". ") == 0 and "\n" not in said
        return said

    def refused_by_poll(self) -> str:
        """What the tooltip of the grey button says; pressing it changes nothing."""
        before = self.state()
        with pytest.raises(RuntimeError, match="poll") as caught:
            self.bpy.ops.dafnet.generate()
        assert self.state() == before
        return str(caught.value)

    def command(self, capfd: pytest.CaptureFixture[str], *options: str) -> tuple[int, str, str]:
        """Save the scene and bake it with the command: exit code, standard output, last line of
        standard error.
        """
        file = self.tmp_path / "scene.blend"
        self.bpy.ops.wm.save_as_mainfile(filepath=str(file))
        capfd.readouterr()
        arguments = ["bake", str(file), "-o", str(self.tmp_path / "out.blend"), "--json", *options]
        code = self.addon("dafnet_addon.cli").main(arguments)
        out, err = capfd.readouterr()
        return code, out, err.strip().splitlines()[-1]

    def heads(self) -> np.ndarray:
        """The bones' heads (12, 22, 3), metres, as Blender plays them."""
        unit = self.addon("dafnet_addon.blender.armature").metres_per_unit(self.scene)
        joints = self.addon("dafnet_addon.core.skeleton").JOINTS
        heads = []
        for frame in range(1, 13):
            self.scene.frame_set(frame)
            played = self.ann.evaluated_get(self.bpy.context.evaluated_depsgraph_get())
            heads.append([played.matrix_world @ played.pose.bones[name].head for name in joints])
        return unit * np.array(heads)


@pytest.fixture
def shot(blender, addon, tmp_path) -> Shot:
    return Shot(blender, addon, tmp_path)


def _spoil_key(shot: Shot, made: Any) -> None:
    shot.key(made, 1, location=tuple(made.location))
    shot.curves(made)[0].keyframe_points[-1].co.y = NAN


def _edited_parent(bones: Any) -> None:
    bones["left_knee"].parent = bones["right_hip"]


def _solo(shot: Shot) -> None:
    shot.bpy.ops.dafnet.generate()
    data = shot.ann.animation_data
    track = data.nla_tracks.new()
    track.strips.new("Take", 1, data.action)
    track.is_solo = True


def _tweaked(shot: Shot) -> None:
    shot.bpy.ops.dafnet.generate()
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
        lambda s: setattr(s.own, "furniture", s.bpy.data.collections["Ann"]),
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
        lambda s: setattr(s.own.hand_left, "location", (0, NAN, 0)),
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
    "stretched time": (lambda s: setattr(s.scene.render, "frame_map_new", 200), "stretches time"),
    "the character as its root": (lambda s: setattr(s.own, "root", s.ann), "follows the character"),
    "root on the character": (
        lambda s: setattr(s.own.root, "parent", s.ann),
        "follows the character",
    ),
    "hand on what follows the character": (
        lambda s: [
            setattr(s.own.hand_left, "parent", s.chair),
            setattr(s.chair.constraints.new("COPY_LOCATION"), "target", s.ann),
        ],
        "left hand target.*follows the character",
    ),
    "uneven scale": (lambda s: setattr(s.ann, "scale", (1, 1, 2)), "scaled unevenly"),
    "bones parented anew": (lambda s: s.edit_bones(_edited_parent), "other parents"),
    "bones that do not inherit": (
        lambda s: setattr(s.ann.data.bones["left_knee"], "use_inherit_rotation", False),
        "other parents or inheritance",
    ),
    "driven armature": (lambda s: s.ann.driver_add("location", 0), "drivers"),
    "rest position": (lambda s: setattr(s.ann.data, "pose_position", "REST"), "rest position"),
    "NLA solo": (_solo, "solo"),
    "NLA tweak mode": (_tweaked, "tweak"),
}


@pytest.mark.parametrize("case", ERRORS)
def test_errors_are_the_same_sentence_at_both_doors(
    shot: Shot, capfd: pytest.CaptureFixture[str], case: str
) -> None:
    change, words = ERRORS[case]
    change(shot)
    said = shot.refused()
    assert re.search(words, said), said
    code, out, err = shot.command(capfd)
    assert (code, out, err) == (1, "", f"dafnet: {said}")
    assert not (shot.tmp_path / "out.blend").exists()


def test_no_root(shot: Shot, capfd: pytest.CaptureFixture[str]) -> None:
    """The button is grey, so its tooltip says it."""
    shot.own.root = None
    assert "Choose the character's root" in shot.refused_by_poll()
    code, _, err = shot.command(capfd)
    assert code == 1 and "has no root; choose" in err


@pytest.mark.parametrize("active", ["nothing", "the chair", "edit mode"])
def test_where_the_button_is_grey_the_command_still_works(
    shot: Shot,
    capfd: pytest.CaptureFixture[str],
    active: str,
) -> None:
    objects = shot.bpy.context.view_layer.objects
    objects.active = {"nothing": None, "the chair": shot.chair, "edit mode": shot.chair}[active]
    if active == "edit mode":
        shot.bpy.ops.object.mode_set(mode="EDIT")
    assert "Select a character" in shot.refused_by_poll()
    code, out, _ = shot.command(capfd)
    assert code == 0 and json.loads(out)["warnings"] == []


@pytest.mark.parametrize("override", [False, True])
def test_linked_and_overridden_characters(
    shot: Shot,
    capfd: pytest.CaptureFixture[str],
    override: bool,
) -> None:
    bpy = shot.bpy
    library = str(shot.tmp_path / "library.blend")
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
    assert "is linked or a library override; make it local" in said
    code, _, err = shot.command(capfd, "--character", shot.ann.name_full)
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
    capfd: pytest.CaptureFixture[str],
    spoilt: Callable[[bytes], bytes] | None,
    words: str,
) -> None:
    file = shot.tmp_path / "weights.safetensors"
    if spoilt:
        file.write_bytes(spoilt(shot.addon("dafnet_addon").load_weights().path.read_bytes()))
    preferences = shot.bpy.context.preferences.addons["bl_ext.user_default.dafnet"].preferences
    preferences.weights = str(file)
    try:
        said = shot.refused()
    finally:
        preferences.weights = ""
    assert words in said and "choose another file" in said
    code, out, err = shot.command(capfd, "--weights", str(file))
    assert (code, out, err) == (1, "", f"dafnet: {said}")


def _delete(shot: Shot, made: Any) -> None:
    """As a user does: what a setting names lives on outside the scene."""
    for each in shot.bpy.context.view_layer.objects:
        each.select_set(each == made)
    shot.bpy.ops.object.delete()


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
    job = shot.addon("dafnet_addon.blender.job")
    made = DELETED[which](shot)
    shot.scene.frame_end = 40
    steps = job.steps(shot.bpy.context, job.settings_of(shot.ann, shot.scene))
    while next(steps) < until:
        pass
    if removed:
        shot.bpy.data.objects.remove(made)
    else:
        _delete(shot, made)
    actions = [action.name for action in shot.bpy.data.actions]
    with pytest.raises(shot.addon("dafnet_addon.core.errors").InputError, match="generate again"):
        for _ in steps:
            pass
    assert [
        action.name for action in shot.bpy.data.actions
    ] == actions and shot.scene.frame_current == 5


def test_the_furniture_collection_is_removed_while_a_take_is_made(shot: Shot) -> None:
    job = shot.addon("dafnet_addon.blender.job")
    steps = job.steps(shot.bpy.context, job.settings_of(shot.ann, shot.scene))
    while next(steps) < 0.5:
        pass
    shot.bpy.data.collections.remove(shot.furniture)
    with pytest.raises(
        shot.addon("dafnet_addon.core.errors").InputError, match="is not in the scene any more"
    ):
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
        shot.key(shot.own.root, frame, location=(0, y, 0))


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
    "furniture that grows from nothing": (
        lambda s: [s.key(s.chair, 1, scale=(0, 0, 0)), s.key(s.chair, 9, scale=(1, 1, 1))],
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
    shot: Shot, capfd: pytest.CaptureFixture[str], case: str
) -> None:
    change, words = WARNINGS[case]
    change(shot)
    capfd.readouterr()
    assert shot.bpy.ops.dafnet.generate() == {"FINISHED"}
    reported = [
        line.removeprefix("Warning: ")
        for line in capfd.readouterr().out.splitlines()
        if "Warning: " in line
    ]
    assert re.search(words, " ".join(reported)), reported
    assert shot.scene.frame_current == 5
    values = [point.co for curve in shot.curves(shot.ann) for point in curve.keyframe_points]
    assert len(values) == (6 + 3 + 22 * 4) * shot.scene.frame_end and np.isfinite(values).all()
    code, out, _ = shot.command(capfd)
    assert code == 0 and json.loads(out)["warnings"] == reported


def _own_things_in_furniture(shot: Shot) -> None:
    for made in (shot.ann, *shot.ann.children, shot.own.root, shot.own.head, shot.own.hand_left):
        shot.furniture.objects.link(made)


def _nested_and_unseen(shot: Shot) -> None:
    for name in ("Excluded", "Closed Eye"):
        shot.mesh(name, location=(0.3, 0.3, 0)).users_collection[0].objects.unlink(
            shot.bpy.data.objects[name]
        )
        shot.collection(name, shot.furniture).objects.link(shot.bpy.data.objects[name])
    shot.shown("Furniture", "Excluded").exclude = True
    shot.shown("Furniture", "Closed Eye").hide_viewport = True
    shot.mesh("Hidden", location=(0.3, 0.3, 0)).hide_set(True)


def _nothing_solid(shot: Shot) -> None:
    shot.mesh("Edges", faces=[], edges=[(0, 1)])
    shot.mesh("Nothing", corners=[], faces=[])
    shot.mesh(
        "Sliver", corners=[(0, 0.5, 0), (0, 0.5, 1), (0, 0.5, 1)], faces=[(0, 1, 2)]
    ).location = (9, 9, 0)
    curve = shot.bpy.data.curves.new("Line", "CURVE")
    curve.splines.new("POLY").points.add(3)
    for data in (
        curve,
        shot.bpy.data.lights.new("Lamp", "POINT"),
        shot.bpy.data.volumes.new("Smoke"),
    ):
        shot.put(data.name, data)


def _posed_by_hand(shot: Shot) -> None:
    for bone in shot.ann.pose.bones:
        bone.location, bone.scale, bone.rotation_mode = (0.2, 0, 0.1), (2, 1, 1), "XYZ"
    shot.ann.location, shot.ann.rotation_mode = (NAN, 3, 4), "AXIS_ANGLE"


def _nla_below_an_added_action(shot: Shot) -> None:
    shot.bpy.ops.dafnet.generate()
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
    "pose mode": lambda s: s.bpy.ops.object.mode_set(mode="POSE"),
    "a scaled, mirrored root": lambda s: setattr(s.own.root, "scale", (-3, 0.5, 2)),
    "the root as a hand that is not asked for": lambda s: setattr(s.own, "hand_left", s.own.root),
    "centimetres": lambda s: s.ann.dimensions,
    "a target on another": lambda s: setattr(s.own.head, "parent", s.own.root),
}


def test_what_makes_no_difference(
    shot: Shot, blender: ModuleType, addon: Callable[[str], Any], tmp_path: Path
) -> None:
    job = addon("dafnet_addon.blender.job")
    assert blender.ops.dafnet.generate() == {"FINISHED"}
    expected = shot.heads()
    for case, change in UNHARMED.items():
        blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        other = Shot(blender, addon, tmp_path, unit=0.01 if case == "centimetres" else 1.0)
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
    assert shot.bpy.ops.dafnet.generate() == {"FINISHED"}
    heads = shot.heads()
    assert np.isfinite(heads).all() and heads[..., 0, 2].min() > 0.2


def test_whatever_becomes_a_mesh_is_read_and_moves(shot: Shot) -> None:
    """Curves with a bevel, text, metaballs, surfaces."""
    data = shot.bpy.data
    text = data.curves.new("Text", "FONT")
    text.body, text.extrude = "Sofa", 0.1
    balls = data.metaballs.new("Balls")
    balls.elements.new()
    rail = data.curves.new("Rail", "CURVE")
    rail.bevel_depth = 0.1
    rail.splines.new("POLY").points.add(1)
    rail.splines[0].points[1].co = (2, 0, 0, 1)
    for made in (text, balls, rail):
        thing = shot.put(made.name, made)
        shot.key(thing, 1, location=(0, 5, 0))
        shot.key(thing, 12, location=(3, 5, 0))
    job = shot.addon("dafnet_addon.blender.job")
    read = shot.addon("dafnet_addon.blender.scene_reader").read_scene(
        shot.bpy.context, job.settings_of(shot.ann, shot.scene)
    )
    solids = {solid.name: solid for solid in read.scene.solids}
    assert set(solids) == {"Chair", "Text", "Balls", "Rail"}
    for name in ("Text", "Balls", "Rail"):
        assert len(solids[name].triangles) and solids[name].matrix[[0, 11], 0, 3] == pytest.approx(
            [0, 3], abs=1e-5
        )


@pytest.mark.parametrize(
    ("output", "words"),
    [("{tmp}/file/out.blend", "file' is no folder"), ("{tmp}/folder.blend", "is a folder")],
)
def test_an_output_that_cannot_be_written(
    shot: Shot,
    capfd: pytest.CaptureFixture[str],
    output: str,
    words: str,
) -> None:
    (shot.tmp_path / "file").write_text("in the way", encoding="utf-8")
    (shot.tmp_path / "folder.blend").mkdir()
    code, out, err = shot.command(capfd, "-o", output.format(tmp=shot.tmp_path))
    assert code == 1 and out == "" and words in err and err.startswith("dafnet: ")
