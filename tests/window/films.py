r"""Films of the pages, picture by picture: the first shot, from the Add menu's example to its take,
and somebody who was led live.

    scripts/window.sh out/films DEBIAN films
    scripts/film.py out/films/first_shot_*.png -o docs/films/first_shot.webp --seconds 11 \
        --crop 0 20 790 560
    scripts/film.py out/films/live_*.png -o docs/films/live.webp --seconds 12 --crop 0 20 790 560
"""

from pathlib import Path

import bpy
from first_shot import look, new_stool, only, progress
from live import drag, draw, pelvis_of, running

from kit.window import Driver, Waits

__all__ = ["films"]


def films(pictures: Path) -> Waits:
    """Pictures of both."""
    user = Driver(pictures)
    yield from user.press("ESC")  # the splash screen
    yield from _first_shot(user)
    yield from _live(user)


def _emptied(user: Driver) -> None:
    with user.override():
        bpy.ops.object.select_all(action="SELECT")
        bpy.ops.object.delete()


def _played(user: Driver, name: str, first: int, every: int) -> Waits:
    """A picture of ``every`` so many frames of the scene, numbered from ``first`` on."""
    scene = bpy.context.scene
    for number, frame in enumerate(range(1, scene.frame_end + 1, every)):
        scene.frame_set(frame)
        yield from user.picture(f"{name}_{first + number:03d}", width=960, colours=256)


def _first_shot(user: Driver) -> Waits:
    _emptied(user)
    yield from user.menu("A", "Chair and Desk")
    character = bpy.context.object
    yield from user.sidebar("DAFNet")
    look(user, (0.0, 0.9, 0.7), 5.5)
    yield from user.picture("first_shot_000", width=960, colours=256)

    yield from user.click("dafnet.generate(task='NEW')")
    yield from user.until(lambda: (progress() or 0.0) > 0.5, "the middle of the job")
    yield from user.picture("first_shot_001", width=960, colours=256)
    yield from user.until(lambda: len(character.dafnet.takes) == 1, "the take")
    yield from _played(user, "first_shot", first=2, every=4)


def _live(user: Driver) -> Waits:
    bpy.ops.wm.read_homefile(app_template="")
    yield 0.5
    user = Driver(user.pictures)
    _emptied(user)
    with user.override():
        bpy.ops.dafnet.add_character()
        stool = new_stool()
    character = bpy.context.scene.objects["Character"]
    character.dafnet.furniture = bpy.data.collections["Studio"]
    look(user, (0.6, 0.4, 0.6), 5.5)
    only(character.dafnet.root)
    yield from user.sidebar("DAFNet")

    yield from user.click("dafnet.live()")
    yield from user.until(running, "Live")
    yield from user.click("dafnet.live_record", 0.8)
    yield from drag(user, (-0.6, 0.9, 0.0), (0.6, -0.6, 0.0))
    yield 1.5
    yield from drag(user, (*stool.location.xy, 0.0))
    yield from user.until(lambda: pelvis_of(character).z < 0.68, "sitting", 60.0)
    yield 1.0
    yield from draw(user, (1.2, 0.4, 0.0), (1.3, -0.4, 0.0), (0.3, -1.0, 0.0), (-0.6, -0.6, 0.0))
    yield 5.0
    yield from user.click("dafnet.live_record", 0.8)
    yield from user.click("dafnet.live()", 0.2)
    yield from user.until(lambda: not running(), "the end of Live", 60.0)
    yield 0.5
    bpy.context.scene.frame_end = int(character.dafnet.root.animation_data.action.frame_range[1])
    yield from _played(user, "live", first=0, every=12)
