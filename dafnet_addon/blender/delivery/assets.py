"""A take as an asset: found in the asset browser by what it is, with a picture of it."""

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.skeleton import PARENTS, PELVIS
from ...core.take import Take
from ..character.takes import stored_take

__all__ = ["mark_as_asset", "picture_of"]

_PIXELS = 256
_POSES = 4  # side by side
_BONE = 2.2  # pixels of half a bone's width
_SKY = (0.14, 0.15, 0.17)
_COLORS = ((0.33, 0.42, 0.55), (0.95, 0.72, 0.35))  # of the first pose and of the last


def mark_as_asset(action: bpy.types.Action) -> None:
    """Mark a take as an asset, with tags that say how it was made and what is to be seen of it,
    and a picture. In which catalog it is stays as it is. ``InputError`` where it is not a take, or
    is linked.
    """
    take, controls = stored_take(action)
    if action.library:
        raise InputError(f"The take '{action.name}' is linked; make it local to mark it.")
    if action.asset_data is None:
        action.asset_mark()
    asset = action.asset_data
    modes = {controls.mode} if isinstance(controls.mode, str) else {*controls.mode}
    words = ["DAFNet", *sorted(modes), *(finding.word for finding in take.verdict if finding.good)]
    known = {tag.name for tag in asset.tags}
    for word in words:
        if word not in known:
            asset.tags.new(word)
    if not asset.description:
        seconds = len(take) / take.fps
        asset.description = f"{seconds:.1f} s, seed {action.dafnet.seed}"
    preview = action.preview_ensure()
    preview.image_size = (_PIXELS, _PIXELS)
    preview.image_pixels_float = picture_of(take).ravel()


def picture_of(take: Take) -> np.ndarray:
    """A picture (256, 256, 4) of a take, rows from below: some of its poses as stick figures, seen
    from the side on which it shows most of its way, the later the brighter.
    """
    chosen = np.linspace(0, len(take) - 1, _POSES).round().astype(int)
    joints = take.joints[chosen].astype(float)
    way = joints[-1, PELVIS, :2] - joints[0, PELVIS, :2]
    facing = take.root[chosen[-1], :2, 1]
    along = way if np.linalg.norm(way) > 0.5 * take.scale else facing
    along = along / max(float(np.linalg.norm(along)), 1e-9)
    flat = np.stack([joints[..., :2] @ along, joints[..., 2]], axis=-1)

    low, high = flat.min(axis=(0, 1)), flat.max(axis=(0, 1))
    size = 0.88 * _PIXELS / max(float((high - low).max()), 1e-6)
    flat = (flat - (low + high) / 2.0) * size + _PIXELS / 2.0

    rows, columns = np.mgrid[:_PIXELS, :_PIXELS] + 0.5
    out = np.empty((_PIXELS, _PIXELS, 4))
    out[..., :3], out[..., 3] = _SKY, 1.0
    for k, pose in enumerate(flat):
        share = k / max(_POSES - 1, 1)
        color = (1.0 - share) * np.array(_COLORS[0]) + share * np.array(_COLORS[1])
        nearest = np.full((_PIXELS, _PIXELS), np.inf)
        for child in range(1, len(PARENTS)):
            nearest = np.minimum(nearest, _off(columns, rows, pose[PARENTS[child]], pose[child]))
        covered = np.clip(_BONE + 0.5 - nearest, 0.0, 1.0)[..., None]
        out[..., :3] = (1.0 - covered) * out[..., :3] + covered * color
    return out


def _off(x: np.ndarray, y: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Distances of pixels from a line between two points."""
    along = end - start
    length = max(float(along @ along), 1e-9)
    share = np.clip(((x - start[0]) * along[0] + (y - start[1]) * along[1]) / length, 0.0, 1.0)
    return np.hypot(x - start[0] - share * along[0], y - start[1] - share * along[1])
