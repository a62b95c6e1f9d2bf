"""What is drawn up to one who sits down: a chair stands away from its table while somebody comes to
it and gets up from it, so for him the table is not there meanwhile.

A piece does not move while it is sat on, so that whoever is sent to a chair under a table has to
stand where nobody could. No captured body ever did, and the network, which sees both, may leave him
standing there.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from .grid import BAND
from .occupancy import distance, occupancy
from .passage import SatOn
from .root import RootPath, to_root, to_world
from .sensor import SPHERES
from .series import runs
from .solids import Box, Mesh, Scene

__all__ = ["in_frames_of", "seen_while_sitting_down", "under"]

_AT_REST = 0.05  # metres from where one sits
_RESTS = 15  # frames at 30 fps that one rests at least
_BEFORE, _AFTER = 60, 45  # frames before one rests, and after
_SETTLES, _LEANS = 20, 15  # frames in which he still sits down, and gets up before the root goes
_TOUCHES = 0.02  # metres from a solid
_HIPS = np.stack(
    np.meshgrid((-0.08, 0.0, 0.08), (-0.08, 0.0, 0.08), np.arange(0.2, 0.9, 0.05)), axis=-1
).reshape(-1, 3)
"""Places under the hips of who sits, in the root's frame, metres."""
_ROOM = np.stack(np.meshgrid((-0.12, 0.0, 0.12), 0.4, np.arange(0.65, 1.3, 0.1)), axis=-1).reshape(
    -1, 3
)
"""Places of the thighs to the chest of who stands before his seat, in the frame of the root that
rests on it; within ``BAND`` of them there has to be nothing.
"""
_SHINS = np.stack(
    np.meshgrid((-0.12, 0.12), (0.35, 0.42), np.arange(0.15, 0.4, 0.08)), axis=-1
).reshape(-1, 3)
"""Places of the shins of who sits: what most of them meet is a wall to him, a bar that is solid to
the floor, which nobody draws up.
"""
_MEETS = 0.08  # metres from a solid: half of a shin, and of how far it may be elsewhere
_BEFORE_SEAT, _BESIDE = 0.25, 1.0  # metres before the hips, and to either side


def seen_while_sitting_down(
    scene: Scene, path: RootPath, seats: Sequence[SatOn], occupied: np.ndarray
) -> np.ndarray:
    """Occupancy (T, 2640) of a path at 30 fps, of which all that stands there is ``occupied``,
    without what leaves nobody room to stand before a seat: from two seconds before somebody rests
    on it until he sits, and from his getting up until one and a half seconds after. Where the
    seat's own mesh leaves no room, as a room in one piece does, what of it is before the seat.

    ``seats``: those that the path rests on (``passage.seats_along``). Canonical metres, solids
    static or with a matrix for each frame of the path.
    """
    out = occupied
    for at, stretch in _comings_and_goings(path, seats):
        there = RootPath(path.position[at, None], path.yaw[at, None])
        seat = {id(solid) for solid in under(scene, there, at)}
        places = to_world(there, _ROOM[None])
        shins = to_world(there, _SHINS[None])
        drawn = {
            id(solid)
            for solid in scene.solids
            if _near(in_frames_of(solid, at), places, there) > 0.0
            and _near(in_frames_of(solid, at), shins, there, _MEETS) <= 0.5
        }
        if not drawn:
            continue

        meanwhile = RootPath(path.position[stretch], path.yaw[stretch])
        shown, own = (
            Scene(tuple(in_frames_of(s, stretch) for s in scene.solids if id(s) in chosen))
            for chosen in ({id(s) for s in scene.solids} - drawn, seat & drawn)
        )
        seen = occupancy(shown, meanwhile)
        if own.solids:
            kept = np.where(_ahead(meanwhile, there), 0.0, occupancy(own, meanwhile))
            seen = np.maximum(seen, kept)
        # Who goes from seat to seat is still before one when he comes to the next.
        out = out.copy() if out is occupied else out
        out[stretch] = np.minimum(out[stretch], seen)

    return out


def _ahead(path: RootPath, there: RootPath) -> np.ndarray:
    """Which spheres of the sensor along a path (T, 2640) are before one who sits where his root
    is ``there``.
    """
    spheres = to_world(path, np.broadcast_to(SPHERES, (len(path), *SPHERES.shape)))
    places = to_root(there, spheres.reshape(1, -1, 3)).reshape(spheres.shape)
    return (places[..., 1] > _BEFORE_SEAT) & (np.abs(places[..., 0]) < _BESIDE)


def under(scene: Scene, there: RootPath, frame: int = 0) -> tuple[Box | Mesh, ...]:
    """The solids of a scene that are, in a frame, under the hips of one who sits where his root is
    ``there`` (one frame).
    """
    places = to_world(there, _HIPS[None])
    return tuple(
        solid
        for solid in scene.solids
        if _near(in_frames_of(solid, frame), places, there, _TOUCHES) > 0.0
    )


def in_frames_of(solid: Box | Mesh, frames: int | slice) -> Box | Mesh:
    """A solid in some of its frames, or as it stands in one of them."""
    matrices = solid.matrices() if isinstance(solid, Box) else solid.matrix
    if matrices.ndim == 2:
        return solid
    some = matrices[frames] if len(matrices) > 1 else matrices[0]
    if isinstance(solid, Box):
        return replace(solid, center=some[..., :3, 3], rotation=some[..., :3, :3])
    return replace(solid, matrix=some)


def _comings_and_goings(path: RootPath, seats: Sequence[SatOn]) -> Iterator[tuple[int, slice]]:
    """When somebody sits down or gets up: a frame in which he rests there, and those meanwhile."""
    frames = len(path)
    for seat in seats:
        there = np.linalg.norm(path.position[:, :2] - seat.place, axis=1) < _AT_REST
        for start, stop in runs(there, _RESTS):
            if start > 0:
                yield start, slice(max(0, start - _BEFORE), min(stop, start + _SETTLES))
            if stop < frames:
                yield stop - 1, slice(max(start, stop - _LEANS), min(frames, stop + _AFTER))


def _near(solid: Box | Mesh, places: np.ndarray, there: RootPath, within: float = BAND) -> float:
    """Share of places (1, N, 3) that are nearer to a solid than so many metres."""
    return float((distance(Scene((solid,)), places, there.position[:, 2]) < within).mean())
