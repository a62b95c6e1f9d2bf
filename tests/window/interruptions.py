"""What a user may do to Blender while a take is made: each time the job ends by itself or goes on,
and nothing breaks.
"""

from collections.abc import Callable, Generator
from pathlib import Path

import bpy
from first_shot import progress

from kit.window import Driver, Waits

__all__ = ["interruptions"]


def _new_shot(user: Driver) -> None:
    """A file with a character that walks ten seconds."""
    with user.override():
        bpy.ops.dafnet.add_character(name="Ann")
    ann = bpy.data.objects["Ann"]
    bpy.context.scene.frame_end = 300
    for frame, y in ((1, 0.0), (300, 8.0)):
        ann.dafnet.root.location.y = y
        ann.dafnet.root.keyframe_insert("location", frame=frame)
    bpy.ops.ed.undo_push(message="Shot")


def _delete_character(_folder: Path) -> None:
    bpy.data.objects.remove(bpy.data.objects["Ann"])


def _delete_root(_folder: Path) -> None:
    bpy.data.objects.remove(bpy.data.objects["Ann Root"])


def _new_scene(_folder: Path) -> None:
    bpy.context.window.scene = bpy.data.scenes.new("Other")


def _save(folder: Path) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "saved.blend"))


def _undo(_folder: Path) -> None:
    bpy.ops.ed.undo()


def _open(folder: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(folder / "saved.blend"))


def _close(_folder: Path) -> None:
    bpy.ops.wm.read_homefile(app_template="")


def _started(folder: Path) -> Generator[float, None, Driver]:
    """A take begun in a new file."""
    bpy.ops.wm.read_homefile(app_template="")
    yield 0.5
    user = Driver(folder)
    yield from user.press("ESC")
    _new_shot(user)
    yield from user.sidebar("DAFNet")
    yield from user.click("dafnet.generate(task='NEW')")
    return user


def interruptions(folder: Path) -> Waits:
    """Run through them, one after the other."""
    done: list[tuple[Callable[[Path], None], bool]] = [
        (_save, True),
        (_new_scene, True),
        (_undo, False),
        (_delete_character, False),
        (_delete_root, False),
        (_open, False),
        (_close, False),
    ]
    for interrupt, finishes in done:
        user = yield from _started(folder)
        yield from user.until(lambda: (progress() or 0.0) > 0.2, "progress")
        with user.override():
            interrupt(folder)
        yield from user.until(
            lambda: progress() is None, f"the end of the job after {interrupt.__name__}"
        )
        yield 0.3
        made = [action for action in bpy.data.actions if "take" in action.name]
        print(f"{interrupt.__name__}: {len(made)} takes", flush=True)
        assert len(made) == finishes, interrupt.__name__
    # And after all of it, a take is made as ever.
    user = yield from _started(folder)
    yield from user.until(lambda: len(bpy.data.objects["Ann"].dafnet.takes) == 1, "the take")
