"""Does what people do in rooms arrive on a real character's rig? Every take of the arranged rooms,
made as the panel makes it and baked.

    dafnet bench baked LIBRARY RIG.json [ROOM …]

The character is made as large as the rig, sent to each seat that is asked for from both places,
generated with the defaults, and baked. What is asked: in every frame a limb that holds on to
nothing, and the trunk, lie within 6 degrees of the character's, elbows and knees as bent; a hand
that holds on to something is within 2 cm of where the character's is, or of its place on the rig's
own thigh, and so are pelvis, head and feet of where they were to lie. Who is refused is told.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.arranged import SCENES, asked_of
from dafnet_addon import InputError
from dafnet_addon.core.limb_errors import limb_errors
from dafnet_addon.core.skeleton import LIMBS

if TYPE_CHECKING:
    from dafnet_addon.blender.delivery.rig_trial import RigTrial

__all__ = ["main"]

_TURNED, _OFF = 6.0, 2.0  # degrees, cm


def _row_of(trial: "RigTrial") -> dict[str, Any]:
    """Degrees by which free limbs and the trunk differ, cm by which contacts do, the most of each,
    and what bake and verdict say.
    """
    free = {name.replace("_", " "): trial.held[:, k] == 0.0 for k, name in enumerate(LIMBS)}
    everywhere = np.ones(len(trial.held), bool)
    return {
        "angles": {
            limb: round(float(off[free.get(limb, everywhere)].max(initial=0.0)), 1)
            for limb, off in limb_errors(trial.theirs, trial.ours).items()
        },
        "contacts": {part: round(100.0 * most, 1) for part, (_, most) in trial.errors.items()},
        "said": trial.said,
        "verdict": trial.verdict,
    }


def faults_of(row: dict[str, Any]) -> list[str]:
    """What of a take is off on the rig."""
    faults = [limb for limb, off in row.get("angles", {}).items() if off > _TURNED]
    return faults + [part for part, off in row.get("contacts", {}).items() if off > _OFF]


def main(arguments: Sequence[str]) -> str:
    """Bake every take of the rooms; a line for each that is off or refused, and a summary."""
    from dafnet_addon.blender.delivery.rig_trial import sent_and_baked

    parser = argparse.ArgumentParser("dafnet bench baked", description=__doc__)
    parser.add_argument("library", type=Path)
    parser.add_argument("rig", type=Path, help="a rest pose (blender.delivery.rig_trial)")
    parser.add_argument("rooms", nargs="*", metavar="ROOM", help="only these; all if left out")
    options = parser.parse_args(arguments)
    rows = []
    for room in options.rooms or SCENES:
        made = SCENES[room](options.library)
        for asked, start in asked_of(made):
            row: dict[str, Any] = {"name": f"{room}: {asked.name} from {start}"}
            try:
                row |= _row_of(
                    sent_and_baked(made.solids, asked.name, asked.near, start, options.rig)
                )
            except InputError as error:
                row["refused"] = str(error)
            rows.append(row)

    baked = [row for row in rows if "angles" in row]
    lines = [
        f"{row['name']}: {row.get('refused') or ', '.join(faults_of(row))}"
        for row in rows
        if "refused" in row or faults_of(row)
    ]
    worst = [
        f"{part} {max(row[kind].get(part, 0.0) for row in baked):.1f}"
        for kind in ("angles", "contacts")
        for part in dict.fromkeys(each for row in baked for each in row[kind])
    ]
    right = sum(not faults_of(row) for row in baked)
    lines.append(
        f"{len(rows)} sent, {len(baked)} baked, {right} right; the most: {', '.join(worst)}"
    )
    return "\n".join(lines)
