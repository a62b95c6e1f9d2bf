"""Overlays: what they show, as arrays with known answers, and that they are off unless switched on
and survive everything.
"""

import ast
import json
from pathlib import Path

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.takes import add_take
from bl_ext.user_default.dafnet.dafnet_addon.blender.overlay import (
    contents,
    display,
    faults,
    painting,
    watched,
)
from bl_ext.user_default.dafnet.dafnet_addon.blender.overlay.cache import cache
from bl_ext.user_default.dafnet.dafnet_addon.blender.overlay.drawing import compose
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.core.progress import run_to_end
from bl_ext.user_default.dafnet.dafnet_addon.core.root import RootPath
from bl_ext.user_default.dafnet.dafnet_addon.core.sensor import RADIUS, SPHERES
from bl_ext.user_default.dafnet.dafnet_addon.core.skeleton import REST
from bl_ext.user_default.dafnet.dafnet_addon.core.solids import box_distance
from bl_ext.user_default.dafnet.dafnet_addon.core.take import Controls, Take
from bl_ext.user_default.dafnet.dafnet_addon.core.weights import (
    load_weights,
    read_safetensors,
    shipped_weights,
    write_safetensors,
)
from bl_ext.user_default.dafnet.panels.overlays import DAFNET_PT_overlays

from kit.panels import drawn_by
from kit.stage import Stage


class Shot(Stage):
    """A character in a scene of this unit scale, a box 40 cm to the left of its root, and takes
    that tests make up.
    """

    def __init__(self, unit: float = 1.0) -> None:
        super().__init__(fps=30, unit=unit)
        self.unit = unit
        half = 0.2 / unit
        self.cube = self.box(
            "Box", (-half,) * 3, (half,) * 3, location=(-0.4 / unit, 0.0, 0.3 / unit)
        )
        self.update()

    def update(self) -> None:
        bpy.context.view_layer.update()

    def is_seen(self, *centre: float) -> bool:
        """Whether the spheres shown are those of the box with its centre there, metres."""
        (drawn,) = self.drawn("spheres")
        return len(drawn.beads) > 25 and bool(
            (box_distance(drawn.beads - centre, np.full(3, 0.2)) < RADIUS).all()
        )

    def drawn(self, kind: str) -> tuple:
        return contents.drawings(bpy.context, [kind]).get(kind, ())

    def add(self, joints: np.ndarray, start: int = 1, play: bool = True, **given):
        """An action that holds a take of these joints (T, 22, 3), metres."""
        frames = len(joints)
        action_shares = given.pop("action", np.full((frames, 10), 0.1))
        path = RootPath(np.c_[joints[:, 0, :2], np.zeros(frames)], np.zeros(frames))
        take = Take(
            30.0,
            joints,
            np.tile([1.0, 0, 0, 0], (frames, 22, 1)),
            path.matrices(),
            action_shares,
            1.0,
            np.zeros((70 + frames, 66)),
            path,
        )
        controls = Controls(30.0, path.matrices(), **given)
        action = bpy.data.actions.new("Ann take")
        add_take(self.ann, action, take, controls, start)
        if play:
            self.ann.animation_data_create().action = action
        self.update()
        return action


@pytest.fixture
def shot(blender):
    made = Shot()
    yield made
    for kind in contents.KINDS:
        display.switch(kind, False)
    display._declined.clear()
    display.hide_live_pose()
    display.hide_faults()
    watched.forget()


def standing(frames: int, speed: float = 0.0) -> np.ndarray:
    """Joints (T, 22, 3) of the rest pose, metres, that glides ahead by so many metres a frame."""
    joints = np.tile(REST, (frames, 1, 1))
    joints[:, :, 1] += speed * np.arange(frames)[:, None]
    return joints


def test_nothing_is_touched_before_a_switch_goes_on(shot: Shot) -> None:
    switches = bpy.context.window_manager.dafnet_overlays
    assert not any(getattr(switches, kind) for kind in contents.KINDS)

    def hooks() -> list[int]:
        told = [getattr(bpy.app.handlers, event) for event in display._LISTENERS]
        ours = [sum(f.__module__ == display.__name__ for f in each) for each in told]
        return [len(display._drawers), sum(ours)]

    assert hooks() == [0, 0]
    switches.path = True
    assert (
        switches.path
        and display.switched_on() == {"path"}
        and hooks() == [2, len(display._LISTENERS)]
    )
    switches.circle = True
    assert hooks() == [2, len(display._LISTENERS)], "one hook for all"
    switches.path = switches.circle = False
    assert hooks() == [0, 0] and not len(cache)
    display.show_live_pose(lambda: None)
    assert hooks() == [2, 0]
    display.hide_live_pose()
    display.show_faults({1: faults.Faults(np.ones(2), np.ones(2))})
    assert hooks() == [1, len(display._LISTENERS)]
    display.hide_faults()
    assert hooks() == [0, 0]
    for file in (display.__file__, painting.__file__):
        body = ast.parse(Path(file).read_text(encoding="utf-8")).body
        top = [node for node in body if isinstance(node, ast.Import | ast.ImportFrom)]
        named = {alias.name for node in top for alias in node.names} | {
            getattr(node, "module", "") for node in top
        }
        assert not named & {"gpu", "gpu_extras.batch", "blf"}


def test_switches_live_in_no_file_and_outlast_another(shot: Shot, tmp_path) -> None:
    display.switch("ghosts", True)
    display.show_faults({1: faults.Faults(np.ones(2), np.ones(2))})
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "on.blend"))
    display.switch("ghosts", False)
    display.hide_faults()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "on.blend"))
    assert not bpy.context.window_manager.dafnet_overlays.ghosts and not display._drawers
    display.switch("ghosts", True)
    display.show_faults({1: faults.Faults(np.ones(2), np.ones(2))})
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "on.blend"))
    assert bpy.context.window_manager.dafnet_overlays.ghosts
    assert set(display._drawers) == {"scene", "corner"}, "faults are of the file that was left"
    assert display._edited in bpy.app.handlers.depsgraph_update_post


def test_unregistering_switches_off(shot: Shot) -> None:
    display.switch("spheres", True)
    display.show_live_pose(lambda: None)
    display.unregister()
    try:
        assert not display._drawers and not display.switched_on()
        assert display._edited not in bpy.app.handlers.depsgraph_update_post
        assert not hasattr(bpy.types.WindowManager, "dafnet_overlays")
    finally:
        display.register()
    assert not bpy.context.window_manager.dafnet_overlays.spheres


@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_a_box_occupies_the_spheres_that_it_covers(shot: Shot, unit: float) -> None:
    if unit != 1.0:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        shot = Shot(unit)
    (drawn,) = shot.drawn("spheres")
    centre = np.array((-0.4, 0.0, 0.3))
    radius = load_weights().sphere_radius
    occupied = np.clip(1.0 - box_distance(SPHERES - centre, np.full(3, 0.2)) / radius, 0.0, 1.0)
    known = SPHERES[occupied > 0.15]
    apart = np.linalg.norm(known[:, None] - unit * drawn.beads[None], axis=-1).min(axis=1)
    assert len(known) > 30 and apart.max() < 1e-3
    assert (box_distance(unit * drawn.beads - centre, np.full(3, 0.2)) < radius).all(), (
        "and no others"
    )
    inside = box_distance(unit * drawn.beads - centre, np.full(3, 0.2)) < -0.02
    assert drawn.bead_colours[inside, 0].min() > 0.95, "red where it is full"
    assert np.allclose(unit * drawn.radii[inside], 0.036, atol=1e-4)


def test_spheres_see_as_far_as_those_of_the_weights_in_use(
    shot: Shot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    count = {}
    for radius in (RADIUS / 2.0, RADIUS):
        file = tmp_path / f"{radius:.3f}.safetensors"
        tensors, words = read_safetensors(shipped_weights())
        config = {**json.loads(words["config"]), "sphere_radius": radius}
        write_safetensors(file, tensors, {**words, "config": json.dumps(config)})
        monkeypatch.setattr(contents, "weights_path", lambda _, file=file: str(file))
        count[radius] = len(shot.drawn("spheres")[0].beads)
    assert count[RADIUS] > 1.5 * count[RADIUS / 2.0]

    monkeypatch.setattr(contents, "weights_path", lambda _: str(tmp_path / "missing.safetensors"))
    assert len(shot.drawn("spheres")[0].beads) == count[RADIUS]


def test_spheres_go_with_the_root_and_the_furniture(shot: Shot) -> None:
    display.switch("spheres", True)
    before = shot.drawn("spheres")
    assert shot.drawn("spheres") is before, "nothing has changed"
    read = list(cache._results["furniture"].values())
    root = shot.ann.dafnet.root
    root.rotation_euler.z = np.pi / 2
    shot.update()
    turned = shot.drawn("spheres")
    assert turned is not before and list(cache._results["furniture"].values()) == read, (
        "the furniture is not read again for it"
    )
    assert shot.is_seen(-0.4, 0.0, 0.3), "the box has not moved"
    shot.cube.location = (0.0, 0.5, 0.3)
    shot.update()
    assert shot.is_seen(0.0, 0.5, 0.3)
    shot.cube.hide_set(True)
    shot.update()
    assert not len(shot.drawn("spheres")[0].beads), "there is no furniture to be seen"
    shot.cube.hide_set(False)
    shot.ann.dafnet.furniture = None
    shot.update()
    assert not len(shot.drawn("spheres")[0].beads)


def test_furniture_that_moves_over_time_is_seen_where_it_is(shot: Shot) -> None:
    display.switch("spheres", True)
    for frame, x in ((1, -0.4), (11, 0.4)):
        shot.cube.location.x = x
        shot.cube.keyframe_insert("location", frame=frame)
    for frame, x in ((1, -0.4), (11, 0.4), (1, -0.4)):
        shot.scene.frame_set(frame)
        assert shot.is_seen(x, 0.0, 0.3)


@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_the_root_path_is_the_takes_else_that_of_the_keys(blender, unit: float) -> None:
    shot = Shot(unit)
    root = shot.ann.dafnet.root
    assert shot.drawn("path") == (), "it is not animated"
    for frame, y in ((1, 0.0), (40, 2.0)):
        root.location.y, root.rotation_euler.z = y / unit, y
        root.keyframe_insert("location", frame=frame)
        root.keyframe_insert("rotation_euler", frame=frame)
    shot.scene.frame_set(40)
    cache.note_edit(None)
    (drawn,) = shot.drawn("path")
    assert np.allclose(unit * drawn.lines[38, 1], (0.0, 2.0, 0.01), atol=1e-5)
    tick = unit * (drawn.lines[39, 1] - drawn.lines[39, 0])
    assert np.allclose(tick, (0.0, 0.14, 0.0), atol=1e-5)
    now = drawn.lines[-1, 1] - drawn.lines[-1, 0]
    assert np.allclose(now / np.linalg.norm(now), (-np.sin(2.0), np.cos(2.0), 0.0), atol=1e-5)
    shot.add(standing(30, 0.05), start=11)
    (drawn,) = shot.drawn("path")
    ends = unit * drawn.lines[:29]
    assert np.allclose(ends[:, 0, 1], 0.05 * np.arange(29), atol=1e-5) and np.allclose(
        ends[0, 0, 2], 0.01
    )
    shot.ann.animation_data.action = None
    root.constraints.new("COPY_LOCATION")
    cache.note_edit(None)
    assert shot.drawn("path") == (), "keys alone would tell a wrong way"


def test_planted_feet_and_collisions_are_marked(shot: Shot) -> None:
    joints = standing(40)
    joints[20:, 10, 2] += 0.3  # the left toe is lifted
    shot.add(joints)
    green, orange, red = (0.35, 0.95, 0.45), (1.0, 0.62, 0.1), (1.0, 0.12, 0.12)

    def beads(colour) -> np.ndarray:
        (drawn,) = shot.drawn("marks")
        return drawn.beads[np.isclose(drawn.bead_colours[:, :3], colour).all(axis=1)]

    display.switch("marks", True)
    shot.scene.frame_set(10)
    assert np.allclose(beads(green)[:, :2], joints[10, [10, 11], :2], atol=1e-5)
    shot.scene.frame_set(30)
    assert np.allclose(beads(green)[:, :2], joints[30, [11], :2], atol=1e-5)
    assert not len(beads(orange)) and not len(beads(red))
    beside = np.array((0.12, 0.0, 0.0))
    # its right side is 8 cm to the right of the left knee
    shot.cube.location = tuple(joints[0, 4] - beside)
    shot.update()
    assert np.allclose(beads(red), joints[30, [4]], atol=1e-5)
    shot.cube.location.x -= 0.13
    shot.update()
    assert np.allclose(beads(orange), joints[30, [4]], atol=1e-5) and not len(beads(red)), (
        "5 cm from it"
    )
    shot.scene.frame_set(41)
    assert shot.drawn("marks") == (), "the take has ended"


def test_the_circle_shows_the_action_of_the_frame(shot: Shot) -> None:
    shares = np.eye(10)[np.arange(20) % 10]
    shot.add(standing(20), start=5, action=shares)
    shot.scene.frame_set(8)
    rim, rays = shot.drawn("circle")
    assert rays.line_colours[:, 3].argmax() == 3 and np.allclose(rays.line_colours[:, 3], shares[3])
    assert [text for _, text, _ in rim.labels] == [str(k) for k in range(1, 11)]
    assert np.allclose(rays.lines[0, 1], (0.0, 1.0, 0.0)) and rays.lines[1, 1, 0] > 0.5, (
        "clockwise from the top"
    )
    bright = [text for _, text, colour in rim.labels if colour[0] == 1.0]
    assert bright == ["4"]
    assert shot.drawn("circle")[0] is rim
    shot.scene.frame_set(4)
    assert shot.drawn("circle") == ()


def test_hands_are_shown_beside_their_targets(shot: Shot) -> None:
    joints = standing(40)
    target = joints[:, 21] + (0.0, 0.05, 0.0)
    mode = ("FREE",) * 10 + ("EE",) * 30
    shot.add(
        joints,
        hand_right=target,
        mode=mode,
        hand_left=joints[:, 20],
        hand_left_influence=np.zeros(40),
    )
    shot.scene.frame_set(20)
    (drawn,) = shot.drawn("reach")
    assert [text for _, text, _ in drawn.labels] == ["5.0 cm"]
    gap = joints[19, 21], target[19]
    assert any(np.allclose(line, gap, atol=1e-5) for line in drawn.lines)
    red = np.abs(drawn.line_colours[:, :3] - (1.0, 0.18, 0.22)).max(axis=1) < 1e-6
    assert red.sum() == 29, "only while it was asked for"
    shot.scene.frame_set(5)
    assert not shot.drawn("reach")[0].labels


def test_ghosts_are_the_other_takes_that_are_ticked(shot: Shot) -> None:
    first = shot.add(standing(20))
    second = shot.add(standing(20) + 1.0, play=False)
    third = shot.add(standing(20, 0.1) + 2.0, start=6, play=False)
    shot.scene.frame_set(10)
    assert shot.drawn("ghosts") == ()
    first.dafnet.ghost = third.dafnet.ghost = True
    (drawn,) = shot.drawn("ghosts")
    assert len(drawn.lines) == 21 and drawn.labels[0][1] == third.name
    assert np.allclose(drawn.lines[0, 0], (standing(20, 0.1) + 2.0)[4, 0], atol=1e-5), (
        "from its own first frame on"
    )
    assert shot.drawn("ghosts")[0] is drawn
    second.dafnet.ghost = True
    assert len(shot.drawn("ghosts")) == 2
    shot.scene.frame_set(1)
    assert np.allclose(
        shot.drawn("ghosts")[1].lines[0, 0], (standing(20, 0.1) + 2.0)[0, 0], atol=1e-5
    ), "it waits"


def test_the_live_pose_is_in_scene_units(blender) -> None:
    Shot(0.01)
    (drawn,) = contents.live_pose(bpy.context, standing(1)[0])
    assert drawn.lines.shape == (21, 2, 3) and np.allclose(
        drawn.lines[:, 1], 100.0 * standing(1)[0, 1:]
    )


def test_what_is_deleted_while_it_is_shown_does_no_harm(shot: Shot) -> None:
    kinds = list(contents.KINDS)
    for kind in kinds:
        display.switch(kind, True)
    ghost = shot.add(standing(20), play=False)
    ghost.dafnet.ghost = True
    shot.add(standing(20))
    shot.scene.frame_set(5)

    def shown() -> set[str]:
        return {kind for kind, drawn in contents.drawings(bpy.context, kinds).items() if drawn}

    assert shown() == set(kinds)
    bpy.data.actions.remove(ghost)
    assert shown() == set(kinds) - {"ghosts"}
    bpy.data.objects.remove(shot.cube)
    shot.update()
    assert shown() == set(kinds) - {"ghosts"} and not len(shot.drawn("spheres")[0].beads)
    bpy.data.actions.remove(shot.ann.animation_data.action)
    assert shown() == {"spheres"}
    bpy.data.objects.remove(shot.ann.dafnet.root)
    shot.update()
    assert shown() == set()
    bpy.data.objects.remove(shot.ann)
    assert contents.drawings(bpy.context, kinds) == {}
    assert display._wanted(bpy.context) == {}, "nor is there a view"
    display._draw_scene()
    display._draw_flat()
    display._draw_timeline()


def test_undo_leaves_overlays_on_and_right(shot: Shot) -> None:
    display.switch("circle", True)
    shot.add(standing(20), action=np.eye(10)[np.zeros(20, int)])
    shot.scene.frame_set(5)
    bpy.ops.ed.undo_push(message="Take")
    assert shot.drawn("circle")[1].line_colours[0, 3] == 1.0
    bpy.data.objects["Ann"].animation_data.action = None
    bpy.ops.ed.undo_push(message="None")
    assert shot.drawn("circle") == ()
    bpy.ops.ed.undo()
    assert shot.drawn("circle")[1].line_colours[0, 3] == 1.0
    assert display.switched_on() == {"circle"}


def test_another_object_may_be_active(shot: Shot) -> None:
    shot.add(standing(20))
    shot.scene.frame_set(5)
    objects = bpy.context.view_layer.objects
    objects.active = shot.cube
    assert watched.watched_character(bpy.context) == shot.ann, "the only character"
    objects.active = shot.ann
    bpy.ops.dafnet.add_character(name="Bob")
    assert watched.watched_character(bpy.context).name == "Bob"
    bpy.ops.object.select_all(action="DESELECT")
    objects.active = shot.cube
    cache.note_edit(None)
    assert watched.watched_character(bpy.context).name == "Bob", (
        "the last one, while the furniture is worked on"
    )


def test_the_path_is_drawn_once_a_walk_is_keyed_unless_it_was_turned_off(shot: Shot) -> None:
    shot.scene.cursor.location = (0.0, 2.0, 0.0)
    assert bpy.ops.dafnet.walk_to(goal="CURSOR") == {"FINISHED"}
    assert display.switched_on() == {"path"} and shot.drawn("path")
    display.switch("path", False)
    shot.scene.cursor.location = (1.0, 3.0, 0.0)
    assert bpy.ops.dafnet.walk_to(goal="CURSOR") == {"FINISHED"}
    assert not display.switched_on()


def test_faulty_frames_are_marked_and_unmarked(shot: Shot) -> None:
    joints = standing(30)
    joints[6:15, [10, 11], 1] += 0.02 * np.arange(1, 10)[:, None]
    joints[15:, [10, 11], 1] += 0.18
    action = shot.add(joints, start=11)
    for frame, x in ((11, -0.4), (30, -0.4), (31, joints[0, 4, 0])):  # onto the left knee
        shot.cube.location = (x, 0.0, joints[0, 4, 2])
        shot.cube.keyframe_insert("location", frame=frame)
    shot.scene.frame_set(17)
    bpy.context.view_layer.objects.active = shot.ann
    assert bpy.ops.dafnet.mark_frames() == {"FINISHED"}
    shown = display.shown_faults(action)
    assert shot.scene.frame_current == 17
    assert np.flatnonzero(shown.sliding).tolist() == list(range(5, 15)) and set(
        shown.sliding[5:15]
    ) == {2}
    assert shown.collisions[:19].max() == 0 and shown.collisions[20:].min() >= 1
    bars = faults.fault_bars(shown, 11)
    assert bars.first[0] == 16 and bars.last[0] == 25 and bars.row[0] == 0
    assert (
        bars.first[1] == 31
        and bars.last[bars.row == 1].max() == 40
        and bars.colours.shape == (len(bars.row), 4)
    )
    assert set(display._drawers) == {"timeline"}
    assert bpy.ops.dafnet.mark_frames() == {"FINISHED"}
    assert display.shown_faults(action) is None and not display._drawers
    shot.ann.animation_data.action = None
    assert not bpy.ops.dafnet.mark_frames.poll()


def test_marking_frames_may_be_stopped_and_sees_what_is_deleted(shot: Shot) -> None:
    takes = [shot.add(standing(30), start=11), shot.add(standing(40), start=11)]
    shot.scene.frame_set(17)
    before, shares = shot.state(), []
    while True:
        steps = faults.faults_of.steps(bpy.context, shot.ann, takes)
        try:
            for _ in range(len(shares) + 1):
                share = next(steps)
        except StopIteration as done:
            assert set(done.value) == {action.session_uid for action in takes}
            break
        shares.append(share)
        assert shot.state() == before
        steps.close()
        assert shot.state() == before
    assert len(shares) > 4 and shares == sorted(shares) and shares[-1] <= 1.0

    steps = faults.faults_of.steps(bpy.context, shot.ann, takes)
    next(steps)
    bpy.data.actions.remove(takes[1])
    with pytest.raises(InputError, match="deleted while takes were measured; try again"):
        run_to_end(steps)
    steps = faults.faults_of.steps(bpy.context, shot.ann, takes[:1])
    next(steps)
    bpy.data.objects.remove(shot.ann)
    with pytest.raises(InputError, match="deleted while"):
        run_to_end(steps)


def test_beads_are_closed_and_lit(shot: Shot) -> None:
    drawn = compose(beads=[(np.array([[1.0, 2.0, 3.0]]), (1.0, 1.0, 1.0, 1.0), 0.5)])
    corners, colours = painting.beads_of(drawn)
    faces = corners.reshape(8, 3, 3)
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    assert ((normals * (faces.mean(axis=1) - (1.0, 2.0, 3.0))).sum(-1) > 0).all(), (
        "all look outward"
    )
    assert np.allclose(np.linalg.norm(corners - (1.0, 2.0, 3.0), axis=1), 0.5)
    assert (
        colours.shape == (24, 4) and 0.3 < colours[:, 0].min() < 0.6 and colours[:, 0].max() > 0.95
    )


def test_the_corner_avoids_the_sidebar(shot: Shot) -> None:
    class Region:
        def __init__(self, kind: str, x: int, width: int) -> None:
            self.type, self.x, self.width = kind, x, width

    window = Region("WINDOW", 100, 800)
    area = type(
        "Area", (), {"regions": [window, Region("TOOLS", 100, 50), Region("UI", 700, 200)]}
    )()
    assert painting.corner_of(area, window, 50.0) == (550.0, 50.0)
    area.regions[2].width, area.regions[2].x = 1, 899
    assert painting.corner_of(area, window, 50.0) == (750.0, 50.0)


def test_the_panel_draws_all_switches(shot: Shot) -> None:

    assert DAFNET_PT_overlays.poll(bpy.context)
    layout = drawn_by(DAFNET_PT_overlays, bpy.context)
    assert set(contents.KINDS) <= set(layout.words())
    assert any(options.get("depress") is False for _, _, options in layout.calls)
