"""What a plan of tasks is: controls with times, what happens when, and the places that are kept."""

from dataclasses import dataclass

import numpy as np

from ..core.root import RootPath
from ..core.take import Controls
from .tasks import SitOn, Task
from .track import Targets

__all__ = ["Entry", "Hold", "Plan"]


@dataclass(frozen=True)
class Entry:
    """One task on the timeline: from frame ``start`` to ``stop`` (exclusive), and from frame
    ``there`` on where it is done, the way there and the hands' having gone before; the names of the
    ``furniture`` and of the ``seat`` that serve it, "" where none does.
    """

    task: Task
    start: int
    there: int
    stop: int
    furniture: str = ""
    seat: str = ""


@dataclass(frozen=True)
class Hold:
    """A place (2,) that somebody keeps for himself, with ``radius`` metres around it, from second
    ``start`` to ``stop`` of the shot.
    """

    place: np.ndarray
    radius: float
    start: float
    stop: float


@dataclass(frozen=True)
class Plan:
    """What somebody does, frame by frame, ``fps`` of them a second; world, metres.

    ``path`` (T): the root's; ``targets``: of hands and head; ``timeline``: the tasks; ``holds``:
    the places that are kept; ``scale``: the body's size over the canonical one; ``begins``: second
    of the shot in which the first frame is; ``warnings``: sentences for the user.
    """

    fps: float
    path: RootPath
    targets: Targets
    timeline: tuple[Entry, ...]
    holds: tuple[Hold, ...] = ()
    scale: float = 1.0
    begins: float = 0.0
    warnings: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.path)

    @property
    def lean(self) -> np.ndarray | None:
        """Degrees (T,) that the trunk leans back while one sits, as the last task to sit down says;
        None where no task asks for any.
        """
        seats = [(e.task, e.start, e.there) for e in self.timeline if isinstance(e.task, SitOn)]
        out = np.zeros(len(self))
        for k, (task, start, there) in enumerate(seats):
            out[max(start, there - round(self.fps)) if k else 0 :] = task.lean
        return out if out.any() else None

    def controls(self) -> Controls:
        """What ``generate`` is given."""
        places, influences = self.targets.places, self.targets.influences
        return Controls(
            fps=self.fps,
            root=self.path.matrices(),
            mode=self.targets.mode,
            head=places.get("head"),
            hand_left=places.get("hand_left"),
            hand_right=places.get("hand_right"),
            head_rotation=self.targets.looks,
            head_influence=influences.get("head"),
            hand_left_influence=influences.get("hand_left"),
            hand_right_influence=influences.get("hand_right"),
            scale=self.scale,
            lean=self.lean,
        )
