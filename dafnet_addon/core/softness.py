"""How far furniture gives way under a body, and how high it carries the pelvis.

A seated pelvis joint is 14 cm over a hard, level top, less over what is hollowed out or
upholstered: medians over captured sitting on real furniture; half of the pieces of a kind lie
within 2 cm. How far one sinks in belongs to the piece: ``Box.softness`` and ``Mesh.softness``, or
what their name and shape tell.
"""

import re
from dataclasses import dataclass

import numpy as np

from .distance import rigid_split
from .occupancy import distance, tops_under
from .root import RootPath
from .solids import Box, Mesh, Scene

__all__ = [
    "LIES_LOWER",
    "OVER_HARD",
    "SOFTNESS",
    "Support",
    "guessed",
    "kind_by_name",
    "support_under",
]

OVER_HARD = 0.14
"""Metres by which a seated pelvis joint is over a hard and level top."""
LIES_LOWER = 0.02
"""Metres by which that of one who lies is lower than that of one who sits."""

SOFTNESS = {
    "armchair": 0.07,
    "toilet": 0.03,
    "sofa": 0.11,
    "bed": 0.11,
    "stool": 0.0,
    "bench": 0.0,
    "chair": 0.03,
    "desk": 0.0,
    "table": 0.0,
}
"""Metres by which a kind of furniture carries a pelvis lower than a hard and level top does."""
_UNKNOWN = 0.02  # metres, of what neither name nor shape tells: a seat of any hard kind

# Words, or ends of words, of names that tell a kind; the first kind that has one counts.
_WORDS = (
    (
        "armchair",
        "armchair lounge lounger deckchair wheelchair recliner relax ottoman pouf office "
        "sessel bürostuhl rollstuhl liege liegestuhl",
    ),
    ("toilet", "toilet toilette"),
    ("sofa", "sofa couch settee loveseat futon"),
    ("bed", "bed mattress bett matratze"),
    ("stool", "stool hocker"),
    ("bench", "bench bank"),
    ("chair", "chair stuhl"),
    ("desk", "desk"),
    ("table", "table tisch"),
    ("sofa", "cushion pillow kissen polster"),
)

# Metres of what a shape has to have to be a bed, a sofa or an arm chair where no word tells.
_BED = (1.8, 0.8)  # long, wide
_SOFA = (1.3, 0.65)  # wide, deep
_ARMCHAIR = (0.7, 0.7)  # wide, deep
_SEAT_HEIGHTS = (0.25, 0.56)  # of their tops over the floor
_BACK = (0.2, 0.8)  # of a back over the top; what is higher is a flight of stairs, or a whole room
_LONGEST = (2.7, 4.0)  # beds and sofas; what is longer is several, or a room


@dataclass(frozen=True)
class Support:
    """What is under a root at T frames: the height (T,) of its ``top`` in the world, NaN where
    there is nothing, its ``softness`` (T,), and which ``solid`` of the scene it is (T,), -1 where
    there is none; canonical metres.
    """

    top: np.ndarray
    softness: np.ndarray
    solid: np.ndarray

    @property
    def carried(self) -> np.ndarray:
        """The heights (T,) at which it carries the pelvis joint of one who sits."""
        return self.top + OVER_HARD - self.softness


def guessed(solid: Box | Mesh, top: float) -> float:
    """The softness (metres) that a solid's name and shape tell; ``top``: height over the floor of
    its surface that carries a body.
    """
    kind = kind_by_name(solid.name) or _kind_by_shape(solid, top)
    return SOFTNESS.get(kind, _UNKNOWN)


def kind_by_name(name: str) -> str:
    """The kind of furniture that a name tells, "" if none."""
    words = re.findall(r"[^\W\d_]+", name.lower())
    words.append("".join(words))
    for kind, telling in _WORDS:
        ends = tuple(telling.split())
        if any(word.removesuffix("s").endswith(ends) for word in words):
            return kind
    return ""


def _kind_by_shape(solid: Box | Mesh, top: float) -> str:
    """Bed, sofa or armchair where the shape is that of one, else ""."""
    lowest, highest = _SEAT_HEIGHTS
    long, short, back = _sides(solid, top)
    if not lowest < top < highest:
        return ""
    if _BED[0] <= long <= _LONGEST[0] and short >= _BED[1] and back < 1.0:
        return "bed"
    if not _BACK[0] < back < _BACK[1] or long > _LONGEST[1]:
        return ""
    if long >= _SOFA[0] and short >= _SOFA[1]:
        return "sofa"
    return "armchair" if long >= _ARMCHAIR[0] and short >= _ARMCHAIR[1] else ""


def _sides(solid: Box | Mesh, top: float) -> tuple[float, float, float]:
    """Metres of a solid's longer and shorter level side, and of what stands up over its ``top``
    over the floor, in the first frame.
    """
    if isinstance(solid, Box):
        size, frame = 2.0 * solid.half_size, solid.matrices().reshape(-1, 4, 4)[0]
    else:
        rigid, linear = (
            each.reshape(-1, *each.shape[-2:])[0] for each in rigid_split(solid.matrix)
        )
        size, frame = np.ptp(solid.vertices @ linear.T, axis=0), rigid
    upright = int(np.argmax(np.abs(frame[2, :3])))
    level = np.delete(size, upright)
    return float(level.max()), float(level.min()), float(size[upright] - top)


def support_under(scene: Scene, path: RootPath) -> Support:
    """What carries a body that sits or lies where the root is; solids as for ``occupancy``."""
    tops = tops_under(scene, path)
    softness, under = np.zeros(len(path)), np.full(len(path), -1)
    there = np.isfinite(tops)
    if there.any():
        places = np.column_stack([path.position[:, :2], np.where(there, tops, 0.0)])[:, None]
        gaps = [distance(Scene((s,)), places, path.position[:, 2])[:, 0] for s in scene.solids]
        under[there] = np.argmin(gaps, axis=0)[there]
        for k in np.unique(under[there]):
            on_it, solid = under == k, scene.solids[k]
            over_floor = float(np.median((tops - path.position[:, 2])[on_it]))
            own = solid.softness
            softness[on_it] = guessed(solid, over_floor) if own is None else own
    return Support(tops, softness, under)
