"""What a folder of motion capture holds: minutes, clips and cut frames by source, subject and
activity.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from ...core.series import MODEL_FPS
from .cuts import REASONS, bad_frames
from .mocap import UNSTATED, Clip

__all__ = ["summary"]

_Key = tuple[str, str, str, str, str]  # source, subject, activity, split, licence

_MINUTE = round(60 * MODEL_FPS)


def summary(clips: Iterable[Clip], left_out: Sequence[str] = ()) -> str:
    """A text table of clips, one line for each source, subject, activity, split and licence, and a
    line of sums.

    Frames that are cut are counted by reason (see ``cuts``), once each under the first that holds.
    A line tells how many clips are refused for training because nobody stated their licence;
    sentences about what was ``left_out`` follow.
    """
    frames: Counter[_Key] = Counter()
    count: Counter[_Key] = Counter()
    cut: defaultdict[_Key, Counter[str]] = defaultdict(Counter)
    for clip in clips:
        key = (clip.source, clip.subject, clip.category, clip.split or "none", clip.licence)
        frames[key] += len(clip.joints)
        count[key] += 1
        seen = np.zeros(len(clip.joints), dtype=bool)
        for reason, bad in bad_frames(clip.joints).items():
            cut[key][reason] += int((bad & ~seen).sum())
            seen |= bad

    def reasons(of: Counter[str]) -> str:
        return ", ".join(f"{of[reason]} {reason}" for reason in REASONS if of[reason]) or "-"

    rows: list[tuple[str, ...]] = [
        ("source", "subject", "activity", "split", "minutes", "clips", "frames cut", "licence")
    ]
    for key in sorted(frames):
        minutes = f"{frames[key] / _MINUTE:.1f}"
        rows.append((*key[:4], minutes, str(count[key]), reasons(cut[key]), key[4]))

    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    right = {4, 5}
    lines = [
        "  ".join(
            cell.rjust(w) if i in right else cell.ljust(w)
            for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]
    bodies = {key[:2] for key in frames}
    total: Counter[str] = sum(cut.values(), Counter())
    lines.append(
        f"{frames.total() / _MINUTE:.1f} minutes, {count.total()} clips, {len(bodies)} bodies; "
        f"{total.total()} of {frames.total()} frames cut: {reasons(total)}"
    )
    unstated = sum(clips_of for key, clips_of in count.items() if key[4] == UNSTATED)
    if unstated:
        lines.append(
            f"{unstated} clips are not trained on: state their licence in clips.json or clips.csv"
        )

    return "\n".join(line.rstrip() for line in (*lines, *left_out))
