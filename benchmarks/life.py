"""Do people live: how they sway as they walk, how long they take to sit down, how much they move
while they sit and stand, and whether feet go where they are asked to.

    dafnet bench life [--weights WEIGHTS] [--motion FOLDER]

Nothing is cleaned up after the model. Straight walks and descents are the director's paths, which
nobody swayed on, among boxes. With ``--motion``, a folder of motion files, what those do who are
never trained on stands beside it: life in three bands of the spectrum, and how far feet are from
where theirs are asked for, or from 10 cm aside of there. ``life.LIMITS`` are what is wanted.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.seats import seat
from dafnet_addon import Controls, Scene, Take, generate, load_weights
from dafnet_addon.core.draws import Draw
from dafnet_addon.core.generate import takes_steps
from dafnet_addon.core.liveliness import BANDS, LIVELY, band_speeds, descent, sway
from dafnet_addon.core.paths import Route, Stop, facing, route
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.root import gaussian
from dafnet_addon.core.series import MODEL_FPS, runs
from dafnet_addon.core.skeleton import (
    ANKLES,
    FEET,
    FEET_ASKED,
    HIPS,
    KNEES,
    OFFSETS,
    PELVIS,
    TARGETS,
)
from dafnet_addon.core.weights import Weights
from dafnet_addon.data.held_out.captured import HeldClip, held_out

__all__ = ["ASKED", "LIMITS", "feet", "led_by", "measure"]

Noise = Sequence[tuple[float, int]]

NOISE: Noise = [(0.0, 0)] + [(1.0, seed) for seed in range(1, 6)]
"""Temperature and seed of every take of a situation."""
ASKED = (0.8, 1.3, 2.0)
"""Seconds of sitting down that are asked for, from 10 to 90 % of the pelvis' way."""
LIMITS = {
    "sway, cm": (2.0, 6.0),
    "sway goes to the standing foot, correlation": (0.5, 1.0),
    "descent over what was asked": (0.8, 1.2),
    "life over the captured one": (0.5, 1.5),
    "feet from where they are asked for, cm": (0.0, 3.0),
}
"""From and to: what is wanted of each measure."""

_PACES = (0.9, 1.1, 1.3)  # metres a second
_WAY = 7.0  # metres of a straight walk
_ENDS = 45  # frames of starting and halting, left out
_SMOOTH = 4.0  # frames; sigma of which foot stands
_PATH = 0.5 * MODEL_FPS  # frames; sigma of the path that a pelvis sways about
_SEAT_HEIGHT = 0.45
_LONG = 8.0  # seconds, within which even a slow descent begins
_SHORTEST = round(5.0 * MODEL_FPS)  # frames of what is seen of somebody who sits or stands
_STANDING = 0.90  # metres of the captured pelvis of one who stands
_STILL = 0.25  # metres a second of his root
_ASIDE = 0.1  # metres
_LEG = 0.99 * float(sum(np.linalg.norm(OFFSETS[[KNEES[0], ANKLES[0]]], axis=-1)))
"""Metres that a leg reaches without being stretched."""


def led_by(joints: np.ndarray) -> float:
    """How far the pelvis of joints (T, 22, 3) that walk straight on is where the standing foot is:
    the correlation of its place aside of its own smooth path with which foot is the slower one.
    """
    place = joints[:, PELVIS, :2]
    way = place[-1] - place[0]
    left = np.array([-way[1], way[0]]) / np.linalg.norm(way)
    aside = (place - gaussian(place, _PATH)) @ left
    speed = np.linalg.norm(np.gradient(joints[:, FEET, :2], axis=0), axis=-1)
    stands = np.sign(speed[:, 1] - speed[:, 0])
    # A body is over its foot in the middle of the stand: lowpassed, the square wave is there, too.
    reach = np.arange(-round(3 * _SMOOTH), round(3 * _SMOOTH) + 1)
    window = np.exp(-0.5 * (reach / _SMOOTH) ** 2)
    stands = np.convolve(stands, window / window.sum(), mode="same")
    return float(np.corrcoef(aside - aside.mean(), stands - stands.mean())[0, 1])


def _takes(
    scene: Scene, controls: Controls, weights: Weights, noise: Noise
) -> Iterator[tuple[float, Take]]:
    draws = [Draw(seed, temperature=temperature) for temperature, seed in noise]
    takes = run_to_end(takes_steps(scene, controls, weights, draws))
    yield from zip([each.temperature for each in draws], takes, strict=True)


def _straight(clip: HeldClip) -> Iterator[np.ndarray]:
    """Joints (N, 22, 3) of captured walks straight on."""
    path = gaussian(clip.joints[:, PELVIS, :2], _PATH)
    along = np.gradient(path, axis=0) * MODEL_FPS
    heading = np.unwrap(np.arctan2(along[:, 1], along[:, 0]))
    pace = np.linalg.norm(along, axis=-1)
    straight = (pace > 0.7) & (pace < 1.6) & (np.abs(np.gradient(heading)) * MODEL_FPS < 0.25)
    for start, stop in runs(straight):
        if stop - start >= 2 * MODEL_FPS:
            yield clip.joints[start:stop]


def _walks(weights: Weights, noise: Noise) -> Iterator[dict[str, Any]]:
    for pace in _PACES:
        walked = route(Stop((0.0, 0.0), 0.0), Stop((0.0, _WAY), 0.0), speed=pace)
        first, last = walked.rests
        inside = slice(first.stop + _ENDS, last.start - _ENDS)
        controls = Controls(fps=MODEL_FPS, root=walked.path.matrices())
        for temperature, take in _takes(Scene(), controls, weights, noise):
            joints = take.joints[inside]
            yield {
                "pace": pace,
                "temperature": temperature,
                "sway": 100.0 * sway(joints, MODEL_FPS),
                "led": led_by(joints),
            }


def _descents(weights: Weights, noise: Noise) -> Iterator[dict[str, Any]]:
    starts = {
        "front": Stop((-1.2, 2.6), facing((0.4, -1.0)), 0.5),
        "side": Stop((2.6, 0.8), facing((-1.0, 0.0)), 0.5),
    }
    for asked in ASKED:
        place = Stop((0.0, 0.0), 0.0, 3.0, seated=True, sits_down=asked)
        for way, start in starts.items():
            walked: Route = route(start, place)
            rest = walked.rests[-1]
            controls = Controls(fps=MODEL_FPS, root=walked.path.matrices())
            chair = seat(_SEAT_HEIGHT, back=True)
            for temperature, take in _takes(chair, controls, weights, noise):
                seated = min(rest.start + round(MODEL_FPS), rest.stop - 1)
                took = descent(take.joints, MODEL_FPS, seated, before=_LONG)
                yield {"asked": asked, "way": way, "temperature": temperature, "took": took}


def _seen(clip: HeldClip) -> dict[str, list[slice]]:
    """Where a clip shows somebody seated, or standing on the spot, for long enough."""
    speed = np.linalg.norm(np.gradient(clip.path.position[:, :2], axis=0), axis=-1) * MODEL_FPS
    stands = (clip.joints[:, PELVIS, 2] > _STANDING) & (speed < _STILL)
    found = {
        "seated": [slice(rest.start, rest.end) for rest in clip.rests],
        "standing": [slice(start, stop) for start, stop in runs(stands)],
    }
    return {
        state: [each for each in stretches if each.stop - each.start >= _SHORTEST]
        for state, stretches in found.items()
    }


def _lives(
    weights: Weights, clips: Sequence[HeldClip], noise: Noise, progress: Callable[[float], None]
) -> dict[str, dict[str, dict[str, float]]]:
    """By state, temperature and band: how fast wrists and head move over how fast captured ones do,
    root mean square of all that is seen; under the band's name with "median", in the median
    stretch, which one who claps does not decide.
    """
    ends = LIVELY["wrists"] + LIVELY["head"]
    speeds: dict[tuple[str, str, str], list[tuple[int, float]]] = defaultdict(list)

    def add(run: str, state: str, joints: np.ndarray) -> None:
        for band, speed in band_speeds(joints, MODEL_FPS, ends, periods=1.0).items():
            speeds[state, run, band].append((len(joints), speed))

    chosen = [(clip, seen) for clip in clips if any((seen := _seen(clip)).values())]
    for done, (clip, seen) in enumerate(chosen):
        progress(done / len(chosen))
        controls = Controls(fps=MODEL_FPS, root=clip.path.matrices())
        takes = {"captured": [clip.joints]}
        for temperature, take in _takes(clip.scene, controls, weights, noise):
            takes.setdefault(f"temperature {temperature:g}", []).append(take.joints)

        for run, made in takes.items():
            for state, stretches in seen.items():
                for joints in made:
                    for stretch in stretches:
                        add(run, state, joints[stretch])

    found: dict[str, dict[str, dict[str, float]]] = defaultdict(lambda: defaultdict(dict))
    for (state, run, band), own in speeds.items():
        if run != "captured":
            (all_made, one_made), (all_real, one_real) = (
                _pooled(values) for values in (own, speeds[state, "captured", band])
            )
            found[state][run][band] = round(all_made / all_real, 3)
            found[state][run][f"{band}, median"] = round(one_made / one_real, 3)
    return {state: dict(rows) for state, rows in found.items()}


def _pooled(speeds: Sequence[tuple[int, float]]) -> tuple[float, float]:
    """Root mean square over all frames, and in the median stretch, of stretches' frames and
    speeds.
    """
    frames, found = np.array(speeds).T
    return float(np.sqrt(np.average(found**2, weights=frames))), float(np.median(found))


def feet(
    weights: Weights, clips: Sequence[HeldClip], progress: Callable[[float], None]
) -> Iterator[dict[str, Any]]:
    """How many centimetres feet are from where captured ones were, asked for with head and hands,
    and without being asked for; and from where they are asked for when that is 10 cm aside of the
    captured ones, in a direction for each foot of each clip, less what legs fall short of there.
    """
    for done, clip in enumerate(clips):
        progress(done / len(clips))
        targets = {name: clip.joints[:, j] for name, j in TARGETS.items()}
        angles = np.random.default_rng(done).uniform(0.0, 2.0 * np.pi, 2)
        aside = {
            name: _ASIDE * np.array([np.cos(angle), np.sin(angle), 0.0])
            for name, angle in zip(FEET_ASKED, angles, strict=True)
        }
        free = {name: at for name, at in targets.items() if name not in aside}
        put_aside = {name: targets[name] + way for name, way in aside.items()}
        given: dict[str, dict[str, Any]] = {
            "asked": targets,
            "not asked": free,
            "asked aside": {**free, **put_aside},
        }
        row: dict[str, Any] = {"clip": clip.name, "activity": clip.activity}
        for run, asked in given.items():
            controls = Controls(MODEL_FPS, clip.path.matrices(), mode="EE", **asked)
            made = generate(clip.scene, controls, weights).joints[:, ANKLES]
            wanted = np.stack([{**targets, **asked}[name] for name in aside], axis=1)
            off = np.linalg.norm(made - wanted, axis=-1)
            if run == "asked aside":
                short = np.linalg.norm(wanted - clip.joints[:, HIPS], axis=-1) - _LEG
                off = np.maximum(off - np.maximum(short, 0.0), 0.0)
            row[run] = 100.0 * float(off.mean())
        yield row


def measure(
    file: Path | None,
    progress: Callable[[float], None],
    motion: Path | None = None,
    noise: Noise = NOISE,
    every: int = 3,
) -> tuple[dict[str, Any], str]:
    """Run the benchmark with the weights in ``file`` (None: those that ship); the report and its
    summary in words. ``every`` so many captured clips of an unseen body ask for feet.
    """
    weights = load_weights(file)
    report: dict[str, Any] = {"walks": list(_walks(weights, noise))}
    progress(0.15)
    report["descents"] = list(_descents(weights, noise))
    progress(0.3)
    if motion is not None:
        clips = [clip for clip in held_out(motion) if clip.unseen and clip.room != "bed"]

        def share(first: float, last: float, part: float) -> None:
            progress(first + (last - first) * part)

        report["captured walks"] = [
            {"sway": 100.0 * sway(joints, MODEL_FPS), "led": led_by(joints)}
            for clip in clips
            for joints in _straight(clip)
        ]
        report["life"] = _lives(weights, clips, noise, partial(share, 0.35, 0.8))
        report["feet"] = list(feet(weights, clips[::every], partial(share, 0.8, 1.0)))

    progress(1.0)
    return report, "\n".join(_summary(report))


def _sways(walks: Sequence[dict[str, Any]]) -> str:
    sways, led = (np.array([each[name] for each in walks]) for name in ("sway", "led"))
    return (
        f"  {len(walks)} straight walks sway by {np.nanmean(sways):.1f} cm ({np.nanmin(sways):.1f} "
        f"to {np.nanmax(sways):.1f}), with the standing foot by {np.median(led):.2f} "
        f"({led.min():.2f} to {led.max():.2f})"
    )


def _summary(report: dict[str, Any]) -> Iterator[str]:
    if captured := report.get("captured walks"):
        yield f"Captured\n{_sways(captured)}"

    for heat in sorted({each["temperature"] for each in report["walks"]}):
        yield f"Temperature {heat:g}"
        yield _sways([each for each in report["walks"] if each["temperature"] == heat])
        words = []
        for asked in ASKED:
            took = [
                each["took"]
                for each in report["descents"]
                if each["temperature"] == heat and each["asked"] == asked
            ]
            words.append(f"{asked:g} s come in {np.nanmean(took):.2f}")
        yield f"  descents asked at {', '.join(words)}"
        for state, rows in report.get("life", {}).items():
            shares = rows[f"temperature {heat:g}"]
            for which, ending in (("", ""), (", in the median stretch", ", median")):
                cells = ", ".join(f"{band} {shares[band + ending]:.2f}" for band in BANDS)
                yield f"  life over the captured one, {state}{which}: {cells}"

    if led := report.get("feet"):
        asked, aside, free = (
            np.mean([each[run] for each in led]) for run in ("asked", "asked aside", "not asked")
        )
        yield (
            f"Feet are {asked:.1f} cm from where they are asked for with head and hands, "
            f"{aside:.1f} from places 10 cm aside of the captured ones, {free:.1f} from these "
            "without being asked for"
        )
