"""A user with mouse and keys in a real Blender window, driven by a script: buttons are found by
what they do.

The script is a generator that yields the seconds to wait; what needs a wait itself is used with
``yield from``. Blender has to run with ``--enable-event-simulate``.
"""

import subprocess
import sys
import traceback
from collections.abc import Callable, Generator
from pathlib import Path
from time import monotonic
from typing import Any

import bpy

__all__ = ["Driver", "Waits", "play"]

Waits = Generator[float, None, None]
_STEP = 11  # pixels between two looks for a button, less than one is high


class Driver:
    """Hands and eyes: clicks, keys and pictures of one Blender window."""

    def __init__(self, pictures: Path) -> None:
        self.pictures = pictures
        self.window = bpy.context.window_manager.windows[0]
        self.mouse = (800, 500)
        self.clicks = 0
        """Clicks and keys so far; a typed word and the choice of a tab count as one each."""

    @property
    def view(self) -> bpy.types.Area:
        """The largest 3D view."""
        areas = [area for area in self.window.screen.areas if area.type == "VIEW_3D"]
        return max(areas, key=lambda area: area.width * area.height)

    def region(self, kind: str) -> bpy.types.Region:
        """The 3D view's region of a kind, such as UI for the sidebar."""
        return next(region for region in self.view.regions if region.type == kind)

    def override(self, kind: str = "WINDOW") -> Any:
        """Context of the 3D view, for operators that are not what is tried out here."""
        return bpy.context.temp_override(
            window=self.window, area=self.view, region=self.region(kind)
        )

    def move(self, x: int, y: int) -> None:
        """The mouse, in pixels of the window from its lower left."""
        self.mouse = (x, y)
        self.window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)

    def press(self, key: str, **modifiers: bool) -> Waits:
        """A key or mouse button, down and up."""
        x, y = self.mouse
        text = {"unicode": key.lower()} if len(key) == 1 else {}
        if not key.startswith("WHEEL"):
            self.clicks += 1
        self.window.event_simulate(key, "PRESS", x=x, y=y, **text, **modifiers)
        yield 0.05
        self.window.event_simulate(key, "RELEASE", x=x, y=y, **modifiers)
        yield 0.2

    def menu(self, key: str, entry: str) -> Waits:
        """Open the 3D view's menu with Shift and a key, type the entry's name, and Return."""
        before, region = self.clicks, self.region("WINDOW")
        self.move(region.x + region.width // 3, region.y + region.height // 2)
        yield 0.2
        yield from self.press(key, shift=True)
        yield 0.4
        for letter in entry.replace(" ", ""):
            yield from self.press(letter.upper())
        yield 0.5
        yield from self.press("RET")
        yield 0.8
        self.clicks = before + 3

    def select(self, *objects: bpy.types.Object) -> None:
        """Select these, the first one active, as a click on each would."""
        self.clicks += len(objects)
        for each in bpy.context.view_layer.objects:
            each.select_set(each in objects)
        bpy.context.view_layer.objects.active = objects[0]

    def sidebar(self, tab: str) -> Waits:
        """Open the sidebar at a tab."""
        self.clicks += 2
        self.view.spaces.active.show_region_ui = True
        yield 0.4
        self.region("UI").active_panel_category = tab
        yield 0.4

    def find(self, action: str, across: float = 0.6) -> Generator[float, None, tuple[int, int]]:
        """Where the sidebar's button is whose Python command or data path holds ``action``; scrolls
        down to it.
        """
        for _page in range(6):
            region = self.region("UI")
            # so that no button is taken for under the mouse still
            self.move(region.x - 200, region.y + 100)
            yield 0.2
            x = region.x + int(across * (region.width - 20))
            for y in range(region.y + region.height - 30, region.y + 4, -_STEP):
                self.move(x, y)
                yield 0.06
                if (yield from self._is_under_mouse(action)):
                    return x, y
            self.move(x, region.y + region.height // 2)
            for _ in range(4):
                yield from self.press("WHEELDOWNMOUSE")
        raise AssertionError(f"no button in the sidebar does '{action}'")

    def _is_under_mouse(self, action: str) -> Generator[float, None, bool]:
        """Whether the button under the mouse does ``action``, and still does a moment later: a slow
        window may be told where the mouse was before.
        """
        if action not in self._under_mouse():
            return False
        yield 0.3
        return action in self._under_mouse()

    def _under_mouse(self) -> str:
        """Python command and data path of the button under the mouse, as its context menu would
        copy them.
        """
        manager = bpy.context.window_manager
        said = ""
        with self.override("UI"):
            for ask in (bpy.ops.ui.copy_python_command_button, bpy.ops.ui.copy_data_path_button):
                if ask.poll():
                    manager.clipboard = ""
                    ask()
                    said += f" {manager.clipboard}"
        return said

    def click(self, action: str, across: float = 0.6) -> Waits:
        """Press the sidebar's button that does ``action``."""
        x, y = yield from self.find(action, across)
        self.move(x, y)
        yield 0.1
        yield from self.press("LEFTMOUSE")

    def click_near(self, action: str, y: int) -> Waits:
        """Press the button in the row at height ``y`` that does ``action``."""
        region = self.region("UI")
        for x in range(region.x + region.width - 30, region.x + 10, -_STEP):
            self.move(x, y)
            yield 0.06
            if (yield from self._is_under_mouse(action)):
                yield from self.press("LEFTMOUSE")
                return
        raise AssertionError(f"no button in that row does '{action}'")

    def key_property(self, path: str, across: float) -> Waits:
        """Insert a keyframe as users do: the mouse over the property, and I."""
        x, y = yield from self.find(path, across)
        self.move(x, y)
        yield 0.1
        yield from self.press("I")

    def until(self, done: Callable[[], bool], what: str, seconds: float = 240.0) -> Waits:
        """Wait for something."""
        latest = monotonic() + seconds
        while monotonic() < latest:
            if done():
                return
            yield 0.1
        raise AssertionError(f"{what} did not come within {seconds:.0f} s")

    def picture(self, name: str, width: int = 1280, colours: int = 160) -> Waits:
        """The whole window as PICTURES/name.png, so many pixels wide."""
        bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
        yield 0.3
        small = ["-resize", f"{width}x", "-colors", str(colours)]
        subprocess.run(
            ["import", "-window", "root", *small, f"png8:{self.pictures / name}.png"], check=True
        )


def play(script: Callable[[], Waits]) -> None:
    """Run the script by a timer; then end Blender, with status 1 and the error where one came."""
    steps = script()

    def step() -> float | None:
        try:
            return next(steps)
        except StopIteration:
            print("Driven to the end", flush=True)
        except BaseException:  # a timer would swallow it, and Blender stay open
            traceback.print_exc()
        sys.stdout.flush()
        bpy.ops.wm.quit_blender()
        return None

    bpy.app.timers.register(step, first_interval=1.0, persistent=True)
