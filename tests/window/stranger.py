"""A stranger's way, by what docs/index.md says: the extension from a repository's address, the
first shot with the mouse, and the take on a rig of one's own. Times of each are printed.
"""

import time
from pathlib import Path
from typing import Any

import bpy
from first_shot import only, progress

from kit.window import Driver, Waits

__all__ = ["stranger"]


def stranger(pictures: Path, builders: Any, address: str) -> Waits:
    """From the ``address`` of a repository's index.json; ``builders``: rigs by script
    (tests/kit/humanoids.py).
    """
    user = Driver(pictures)
    began = time.monotonic()

    def told(what: str) -> None:
        print(f"{what}: after {time.monotonic() - began:.0f} s", flush=True)

    yield from user.press("ESC")  # the splash screen
    # What the dialogs of Preferences > Get Extensions call.
    bpy.context.preferences.system.use_online_access = True
    bpy.ops.preferences.extension_repo_add(
        name="DAFNet", remote_url=address, use_sync_on_startup=False, type="REMOTE"
    )
    repositories = bpy.context.preferences.extensions.repos
    place = next(k for k, each in enumerate(repositories) if each.name == "DAFNet")
    bpy.ops.extensions.repo_sync(repo_index=place)
    bpy.ops.extensions.package_install(
        repo_index=place, pkg_id="dafnet", enable_on_install=True, do_legacy_replace=False
    )
    yield from user.until(lambda: hasattr(bpy.ops.dafnet, "generate"), "the extension")
    told("installed and enabled")

    yield from user.menu("A", "Chair and Desk")
    character = bpy.context.object
    yield from user.sidebar("DAFNet")
    yield from user.click("dafnet.generate(task='NEW')")
    yield from user.until(
        lambda: progress() is None and len(character.dafnet.takes) == 1, "the take", 600.0
    )
    told("the first take")
    bpy.context.scene.frame_set(120)
    yield from user.picture("stranger_take")
    with user.override():
        bpy.ops.wm.save_as_mainfile(filepath=str(pictures / "shot.blend"))

    with user.override():
        rig = builders.mixamo(bpy)
    only(rig)
    yield 0.3
    yield from user.click("dafnet.detect_rig")
    yield from user.click("dafnet.bake_to_rig")
    yield from user.until(
        lambda: bool(rig.animation_data and rig.animation_data.action), "the bake", 240.0
    )
    told("on a rig of one's own")
    bpy.context.scene.frame_set(121)
    yield from user.picture("stranger_rig")
