"""What stays of a take while the rest of it, or its middle, is made anew."""

from dataclasses import dataclass

import numpy as np

from .beginning import PREROLL
from .conditions import Shot
from .errors import InputError
from .meeting import require_same_root
from .resampling import covering_frames
from .root import RootPath, to_root, to_world
from .series import MODEL_FPS
from .take import Controls, Take

__all__ = ["Kept", "kept_before", "kept_of"]

_HAIR = 1e-3  # of a length: what comes back from single precision is the same


@dataclass(frozen=True)
class Kept:
    """What stays of motion that is known: ``poses`` (PREROLL + N, 66), in the frames of the shot's
    path, but those of the ``middle``, a stretch (first, stop) of the shot's frames that is made
    anew between two that stay.
    """

    poses: np.ndarray
    middle: tuple[int, int] | None = None

    def of_takes(self, takes: int) -> np.ndarray:
        """The poses (PREROLL + N, B, 66) as the sampler takes them."""
        poses = np.repeat(self.poses[:, None], takes, axis=1)
        if self.middle is not None:
            poses[PREROLL + self.middle[0] : PREROLL + self.middle[1]] = np.nan
        return poses


def kept_before(shot: Shot) -> Kept | None:
    """What a shot begins with, where that is given."""
    return None if shot.before is None else Kept(shot.before)


def kept_of(
    resume: Take, frame: int, until: int | None, controls: Controls, path: RootPath
) -> Kept:
    """What is kept of the resumed take: its poses before a frame of the controls, and from the
    frame ``until`` on, in the new path's frames.

    The two may have other rates, and the body another size: it keeps its place in the world beside
    the take's root.
    """
    seconds = len(resume) / resume.fps
    for each, doing in ((frame, "go on"), (until, "come back to it")):
        if each is not None and not 0 < each / controls.fps <= seconds * (1.0 + _HAIR):
            raise InputError(
                f"Frame {each} is not inside the take, which lasts {seconds:.2f} s; {doing} from a "
                "frame in it."
            )
    if until is not None and until <= frame:
        raise InputError(
            f"The part that is made anew ends at frame {until}, before its start at {frame}; give "
            "it a frame at least."
        )

    longest = min(len(resume.path), len(path))
    first = min(covering_frames(frame, controls.fps), longest)
    count = first if until is None else longest
    old = RootPath(
        resume.path.position[:count] * (resume.scale / controls.scale), resume.path.yaw[:count]
    )
    new = RootPath(path.position[:count], path.yaw[:count])
    shot = resume.poses[PREROLL : PREROLL + count].reshape(count, 22, 3)
    poses = np.concatenate(
        [resume.poses[:PREROLL], to_root(new, to_world(old, shot)).reshape(count, 66)]
    )
    if until is None:
        return Kept(poses)
    stop = min(covering_frames(until + 1, controls.fps) - 1, longest)
    if stop - first < 1:
        enough = int(np.ceil(2.0 * controls.fps / MODEL_FPS)) - 1
        raise InputError(
            f"The part that is made anew, from frame {frame} to before {until}, lies between two "
            f"frames of the model, which makes {MODEL_FPS:g} a second; give it {enough} frames at "
            "least."
        )
    require_same_root(old, new, stop)
    return Kept(poses, (first, stop))
