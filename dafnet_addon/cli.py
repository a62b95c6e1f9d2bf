"""The command ``dafnet``: one parser behind ``python -m dafnet_addon …`` and ``blender [file]
--command dafnet …``.

Results go to standard output, for machines with ``--json``; progress and errors go to standard
error. Exit codes: 0 done, 1 an error said in one sentence, 2 a wrong command line, 128 and its
number for a signal: 130 for Ctrl-C.
"""

import argparse
import ctypes
import importlib.util
import io
import json
import math
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, TextIO

from .core.checks import MAX_SEED
from .core.errors import DafnetError, InputError
from .core.files import require_writable, save_text
from .core.stopping import Stop
from .core.take import MODES
from .core.text import printable
from .core.threads import cores

if TYPE_CHECKING:
    from .data.held_out.captured import HeldClip

__all__ = ["main", "run"]

_Result = tuple[Any, str] | None
"""What a command found, for machines and for people."""

_MAX_PROCESSES = 1024
"""More than any machine has cores."""
_PACKAGES = {"PIL": "pillow"}
"""The packages to install for modules that have other names than their package."""
_MAX_SHOWN = 2000
"""Characters of a text from a file that are printed; --json gives all of it."""
_MEASURES = ("seats", "speed")
"""What ``bench`` measures of the weights."""
_RESEARCH = {"ablation": "ablation", "canonical": "canonical", "tables": "experiments"}
"""What ``bench`` runs for docs/training.md and docs/experiments.md, and the scripts that do it."""


def main(
    argv: Sequence[str] | None = None, in_blender: bool = False, loading: Stop | None = None
) -> int:
    """Run one command and return its exit code.

    ``in_blender``: the file that Blender has open is the scene. ``loading``: knows whether a stop
    was requested while the program was being loaded.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # A name with letters that the terminal does not have is no reason to fail.
            stream.reconfigure(errors="backslashreplace")

    try:
        if loading:
            loading.now()

        options = _parser(in_blender).parse_args(argv)
        _require(options)
        with ExitStack() as stack:
            # A command that runs Blender stops between two steps, any other wherever it is.
            now = stack.enter_context(Stop()).now if "bpy" in options.needs(options) else _never
            with _only_our_output(), _Bar(now) as bar:
                found = options.run(options, bar)
            if found is not None:
                _say(json.dumps(found[0], indent=2) if options.json else found[1])

        return 0
    except SystemExit as stop:  # argparse has said why
        _say("")
        return int(stop.code or 0)
    except DafnetError as error:
        _complain(f"dafnet: {error}")
        return 1
    except OSError as error:
        _complain(
            f"dafnet: {error.filename or 'A file'} cannot be used ({error.strerror}); check its "
            "path."
        )
        return 1
    except KeyboardInterrupt as stop:
        _complain("dafnet: stopped.")
        return 128 + (stop.args[0] if stop.args else signal.SIGINT)


def run(loading: Stop | None = None) -> None:
    """``main`` as a process."""
    _open_streams()
    code = main(loading=loading)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            _discard(stream)

    if "bpy" in sys.modules:
        # The module of Blender 4.2 crashes at exit once a property with a poll function was
        # registered, unregistered or not.
        os._exit(code)

    sys.exit(code)


def _open_streams() -> None:
    """Open standard streams that were closed on the null device, before a file gets their number,
    and with it what is printed.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            # The system gives it the lowest free number, which is this one.
            setattr(sys, name, open(os.devnull, "w" if number else "r", encoding="utf-8"))  # noqa: SIM115


def _discard(stream: TextIO) -> None:
    """Point a stream that cannot be written at the null device: what it still holds would fail
    again at exit.
    """
    with open(os.devnull, "wb") as nowhere:
        os.dup2(nowhere.fileno(), stream.fileno())


def _say(text: str) -> None:
    """Print the result on standard output; a reader that has read enough, such as ``head``, is not
    an error.
    """
    try:
        if text:
            print(text)
        sys.stdout.flush()
    except OSError as error:
        _discard(sys.stdout)
        if not isinstance(error, BrokenPipeError):
            raise InputError(
                f"The result cannot be written to standard output ({error.strerror})."
            ) from error


def _complain(text: str, end: str = "\n") -> None:
    """Print on standard error, if anything reads it."""
    with suppress(OSError):
        print(text, end=end, file=sys.stderr, flush=True)


def _never() -> None:
    """A command that is stopped by an exception need not ask whether to stop."""


def _parser(in_blender: bool) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="dafnet",
        description="A character that walks up to furniture and uses it, from an animated root.",
    )
    commands = parser.add_subparsers(metavar="command", required=True)

    def command(
        name: str,
        action: Callable[[argparse.Namespace, "_Bar"], _Result],
        text: str,
        *,
        part: str = "",
        needs: Callable[[argparse.Namespace], Sequence[str]] = lambda _: (),
    ) -> argparse.ArgumentParser:
        """A subcommand. ``part``: the folder of the checkout that it needs. ``needs``: the modules
        that it needs besides NumPy, which may depend on its options.
        """
        added = commands.add_parser(name, help=text, description=text)
        added.set_defaults(run=action, in_blender=in_blender, part=part, needs=needs)
        added.add_argument(
            "--json", action="store_true", help="print the result as JSON on standard output"
        )
        return added

    def sampling(added: argparse.ArgumentParser, temperature: float | None) -> None:
        default = None if temperature is None else 0
        added.add_argument(
            "--seed", type=_number(int, 0, MAX_SEED), default=default, help="seed of the noise"
        )
        added.add_argument(
            "--temperature",
            type=_number(float, 0.0),
            default=temperature,
            help="0 gives the calm take, 1 is as lively as real motion",
        )
        added.add_argument(
            "--weights",
            type=Path,
            metavar="FILE",
            help="trained weights; the ones that ship if left out",
        )

    demo = command(
        "demo",
        _demo,
        "build the example room, generate, bake, render a preview and report",
        needs=lambda _: ("bpy",),
    )
    demo.add_argument("-o", "--output", type=Path, default=Path("out/demo"), metavar="FOLDER")
    demo.add_argument("--no-preview", action="store_true", help="make no film and no contact sheet")
    sampling(demo, 0.0)

    bake = command(
        "bake",
        _bake,
        "generate the motion of a scene's character and save the scene with its keys",
        needs=lambda _: ("bpy",),
    )
    bake.add_argument("file", type=Path, nargs="?" if in_blender else None, metavar="FILE.blend")
    written = bake.add_mutually_exclusive_group(required=True)
    written.add_argument("-o", "--output", type=Path, metavar="OUT.blend")
    written.add_argument("--in-place", action="store_true", help="overwrite FILE.blend itself")

    bake.add_argument(
        "--scene",
        metavar="NAME",
        help="the scene to use instead of the one that is active in the file",
    )
    bake.add_argument(
        "--character", metavar="ARMATURE", help="needed where the scene has several characters"
    )
    for name in ("root", "furniture", "head", "hand-left", "hand-right", "upper-body"):
        bake.add_argument(f"--{name}", metavar="NAME", help="overrides the character's own setting")

    bake.add_argument("--mode", choices=MODES, help="one mode for all frames")
    bake.add_argument(
        "--frames",
        type=_frames,
        metavar="A:B",
        help="first and last frame; write --frames=A:B if A is negative",
    )

    share = _number(float, 0.0, 1.0)
    bake.add_argument(
        "--plant-feet",
        type=share,
        metavar="SHARE",
        help="0 leaves the feet as generated, 1 holds standing feet in place",
    )
    bake.add_argument(
        "--rest-on-seats",
        type=share,
        metavar="SHARE",
        help="0 leaves the body as generated, 1 lifts it out of a seat that it has sunk into",
    )
    bake.add_argument(
        "--reach-targets",
        type=share,
        metavar="SHARE",
        help="0 leaves head and hands as generated, 1 puts them onto their targets",
    )
    bake.add_argument(
        "--clear-furniture",
        type=share,
        metavar="SHARE",
        help="0 leaves hands and feet as generated, 1 moves them out of furniture",
    )
    bake.add_argument(
        "--smooth",
        type=share,
        metavar="SHARE",
        help="0 leaves the motion as generated, 1 smooths out abrupt changes",
    )

    bake.add_argument(
        "--takes",
        type=_number(int, 1),
        default=1,
        metavar="N",
        help="how many takes; the first one plays",
    )
    sampling(bake, None)

    info = command("info", _info, "describe a weights file")
    info.add_argument(
        "weights", type=Path, nargs="?", metavar="WEIGHTS", help="the weights that ship if left out"
    )

    prepare = command(
        "prepare",
        _prepare,
        "make a training set from motion files, or resume making one",
        part="data",
        needs=lambda _: ("matplotlib",),
    )
    prepare.add_argument("folder", type=Path, metavar="FOLDER", help="folder of motion files")
    prepare.add_argument("-o", "--output", type=Path, required=True, metavar="DATASET")
    prepare.add_argument(
        "--furniture",
        type=Path,
        metavar="LIBRARY",
        help="folder of real furniture to use besides boxes",
    )
    prepare.add_argument(
        "--windows", type=_number(int, 1), default=12000, help="how many training windows"
    )
    prepare.add_argument("--processes", type=_number(int, 1, _MAX_PROCESSES), default=cores())
    prepare.add_argument("--seed", type=_number(int, 0, MAX_SEED), default=0)

    train = command(
        "train",
        _train,
        "train a model, or resume a run, and write its weights",
        part="training",
        needs=lambda _: ("torch",),
    )
    train.add_argument(
        "config", type=Path, metavar="CONFIG.toml", help="sizes and budgets; see configs/"
    )
    train.add_argument("dataset", type=Path, metavar="DATASET", help="made by 'prepare'")
    train.add_argument(
        "-o", "--output", type=Path, required=True, metavar="RUN", help="folder of the run"
    )
    train.add_argument(
        "--minutes",
        type=_number(float, 0.0),
        help="how long to train the flow, instead of what the configuration says",
    )
    train.add_argument(
        "--from",
        dest="begin_with",
        type=Path,
        metavar="WEIGHTS",
        help="weights that a new run starts from",
    )
    train.add_argument(
        "--device", default="cpu", help="'cpu', or 'cuda'; several GPUs through torchrun"
    )
    train.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a setting instead of the configuration's, as batch=256 or width=384",
    )

    carry = command(
        "carry",
        _carry,
        "make a dataset or a run small enough for another machine, or a carried dataset whole",
        part="training",
        needs=lambda o: ("torch",) if any(o.folder.glob("*.checkpoint")) else (),
    )
    carry.add_argument("folder", type=Path, metavar="FOLDER", help="a dataset, or a run's folder")
    carry.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER")
    carry.add_argument(
        "--mebibytes",
        type=_number(float, 1.0),
        default=60.0,
        help="of a dataset: as many windows as go into so much",
    )

    validate = command(
        "validate",
        _validate,
        "measure a run among real furniture while it trains, and keep its best weights",
        part="training",
        needs=lambda _: ("torch", "matplotlib"),
    )
    validate.add_argument("training", type=Path, metavar="RUN", help="folder of the run")
    validate.add_argument("dataset", type=Path, metavar="DATASET", help="that it trains with")
    validate.add_argument("folder", type=Path, metavar="FOLDER", help="holds the motion files")
    validate.add_argument(
        "--furniture", type=Path, required=True, metavar="LIBRARY", help="folder of real pieces"
    )
    validate.add_argument(
        "--every",
        type=_number(float, 0.0),
        metavar="MINUTES",
        help="measure again and again until the run's budget is spent",
    )
    validate.add_argument("--processes", type=_number(int, 1, _MAX_PROCESSES), default=1)

    cool = command(
        "cool",
        _cool,
        "train a copy of a run for some minutes in which its rate falls, and write its weights",
        part="training",
        needs=lambda _: ("torch",),
    )
    cool.add_argument("training", type=Path, metavar="RUN", help="folder of the run, only read")
    cool.add_argument("dataset", type=Path, metavar="DATASET", help="that it trains with")
    cool.add_argument(
        "-o", "--output", type=Path, required=True, metavar="CANDIDATE", help="folder of the copy"
    )
    cool.add_argument(
        "--minutes", type=_number(float, 0.0), default=5.0, help="of each part's training"
    )
    cool.add_argument("--device", default="cpu", help="'cpu' or 'cuda'")

    evaluate = command(
        "evaluate",
        _evaluate,
        "measure weights on held-out clips, and the clips themselves for comparison",
        part="training",
        needs=lambda o: (
            "torch",
            *(("matplotlib",) if o.output or o.sheets else ()),
            *(("PIL",) if o.sheets else ()),
        ),
    )
    evaluate.add_argument("folder", type=Path, metavar="FOLDER", help="folder of motion files")
    evaluate.add_argument(
        "--weights",
        type=Path,
        metavar="FILE",
        help="trained weights; the ones that ship if left out",
    )
    evaluate.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FOLDER",
        help="write evaluation.json, .md and .png there",
    )
    evaluate.add_argument(
        "--save", action="store_true", help="write the figures into the weights' metadata"
    )
    evaluate.add_argument(
        "--sheets",
        type=Path,
        metavar="FOLDER",
        help="also draw twenty clips, real motion above generated motion",
    )
    evaluate.add_argument(
        "--furniture",
        type=Path,
        metavar="LIBRARY",
        help="measure among this real furniture instead",
    )
    evaluate.add_argument(
        "--role",
        choices=["choose", "tell"],
        default="choose",
        help=(
            "with --furniture: the bodies and makers kept for choosing a model, or those kept for "
            "reporting on it"
        ),
    )

    bench = command(
        "bench",
        _bench,
        "measure: 'seats' sits on ten heights from three sides; 'speed' times every system; "
        "'canonical' fits bodies to the skeleton; 'ablation' and 'tables' train and compare",
        part="../benchmarks",
        needs=lambda o: () if o.name in ("seats", "canonical") else ("torch",),
    )
    bench.add_argument("name", choices=[*_MEASURES, *_RESEARCH])
    bench.add_argument(
        "--weights",
        type=Path,
        metavar="FILE",
        help="trained weights; the ones that ship if left out",
    )
    bench.add_argument(
        "arguments",
        nargs=argparse.REMAINDER,
        help="of 'ablation', 'canonical' and 'tables'; they say which with '-- --help'",
    )

    figures = command(
        "figures",
        _figures,
        "draw the paper's figures with these weights",
        part="../benchmarks",
        needs=lambda _: ("bpy", "PIL"),
    )
    figures.add_argument("-o", "--output", type=Path, default=Path("out/figures"), metavar="FOLDER")
    figures.add_argument(
        "--weights",
        type=Path,
        metavar="FILE",
        help="trained weights; the ones that ship if left out",
    )
    figures.add_argument(
        "--other",
        action="append",
        default=[],
        metavar="NAME=FILE",
        help="weights of another system",
    )
    figures.add_argument(
        "--only",
        nargs="+",
        metavar="NUMBER",
        help="figure numbers as in the paper; all if left out",
    )
    return parser


def _number(
    kind: type[int] | type[float], low: float, high: float = math.inf
) -> Callable[[str], float]:
    """A reader of an option that is a finite number of this kind, from ``low`` to ``high``."""
    what = "whole number" if kind is int else "number"
    limits = f"from {low:g} to {high:.10g}" if high < math.inf else f"of at least {low:g}"

    def read(text: str) -> float:
        try:
            value = kind(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high or value == math.inf:
            raise argparse.ArgumentTypeError(f"'{text}' is not a {what} {limits}")
        return value

    return read


def _frames(text: str) -> tuple[int, int]:
    first, _, last = text.partition(":")
    try:
        return int(first), int(last)
    except ValueError as error:
        raise argparse.ArgumentTypeError(
            f"'{text}' is not a range; write it as FIRST:LAST"
        ) from error


def _demo(options: argparse.Namespace, bar: "_Bar") -> _Result:
    from .blender.showcase.demo_room import run_demo

    report = run_demo(
        options.output,
        seed=options.seed,
        temperature=options.temperature,
        weights=options.weights,
        preview=not options.no_preview,
        progress=bar,
    )
    seats = (
        f"{seat['name']}: seat {seat['seat_height']:.2f} m, pelvis {seat['pelvis_height']:.3f} m, "
        f"{100 * seat['error']:+.1f} cm from where it should be"
        for seat in report["seats"]
    )
    return report, "\n".join((*seats, f"Written to {options.output}"))


def _bake(options: argparse.Namespace, bar: "_Bar") -> _Result:
    from .blender.pipeline.batch import bake_takes
    from .core.weights import load_weights

    weights = load_weights(options.weights) if options.weights else None
    changes = {
        "root": options.root,
        "furniture": options.furniture,
        "head": options.head,
        "hand_left": options.hand_left,
        "hand_right": options.hand_right,
        "upper_body_source": options.upper_body,
        "mode": options.mode,
        "temperature": options.temperature,
        "seed": options.seed,
        "plant_feet": options.plant_feet,
        "rest_on_seats": options.rest_on_seats,
        "reach_targets": options.reach_targets,
        "clear_furniture": options.clear_furniture,
        "smooth": options.smooth,
    }
    if options.frames:
        changes["frame_start"], changes["frame_end"] = options.frames

    output, result = bake_takes(
        options.file,
        options.output,
        scene=options.scene,
        character=options.character,
        takes=options.takes,
        weights=weights,
        progress=bar,
        changes={name: value for name, value in changes.items() if value is not None},
    )

    report: dict[str, Any] = {
        "output": str(output),
        "takes": [
            {
                "action": action.name,
                "seed": draw.seed,
                "temperature": draw.temperature,
                "frames": len(take),
                "log_likelihood": round(take.log_likelihood, 3),
                "metrics": take.metrics,
                "raw_metrics": take.raw_metrics,
            }
            for action, draw, take in zip(result.actions, result.draws, result.takes, strict=True)
        ],
        "warnings": list(result.warnings),
        "seconds": {stage: round(spent, 4) for stage, spent in result.seconds.items()},
    }

    lines = [f"Warning: {printable(warning, _MAX_SHOWN)}" for warning in report["warnings"]]
    for take in report["takes"]:
        slides = f"{take['metrics']['foot_sliding_per_frame']:.2f} sliding feet per frame"
        lines.append(
            f"{printable(take['action'])}: {take['frames']} frames, seed {take['seed']}, {slides}"
        )

    lines.append(
        ", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in report["seconds"].items())
    )
    return report, "\n".join((*lines, f"Written to {output}"))


def _info(options: argparse.Namespace, _bar: "_Bar") -> _Result:
    from .core.weights import load_weights

    weights = load_weights(options.weights)
    described: dict[str, Any] = {
        "file": str(weights.path),
        "bytes": weights.path.stat().st_size,
        "parameters": sum(int(tensor.size) for tensor in weights.tensors.values()),
    }
    described |= {
        key: weights.says(key) for key in sorted(weights.metadata) if key not in described
    }
    return described, "\n".join(
        f"{printable(key)}: "
        f"{printable(value if isinstance(value, str) else json.dumps(value), _MAX_SHOWN)}"
        for key, value in described.items()
    )


def _prepare(options: argparse.Namespace, bar: "_Bar") -> _Result:
    from .data.dataset.prepare import prepare

    require_writable(options.output / "dataset.json")
    prepare(
        options.folder,
        options.output,
        windows=options.windows,
        processes=options.processes,
        seed=options.seed,
        progress=bar,
        furniture=options.furniture,
    )
    description, summary, fits = (
        (options.output / name).read_text(encoding="utf-8")
        for name in ("dataset.json", "summary.txt", "fits.txt")
    )
    written = f"Written to {options.output}; look at its preview.png"
    return json.loads(description), summary + fits + written


def _train(options: argparse.Namespace, bar: "_Bar") -> _Result:
    from .core.weights import load_weights
    from .training import precision, ranks
    from .training.candidates import write_weights
    from .training.train import read_config, train

    model, config = read_config(options.config, options.set)
    if options.minutes is not None:
        config = replace(config, minutes_flow=options.minutes)

    device = ranks.device_of(options.device)
    begin_with = load_weights(options.begin_with) if options.begin_with else None
    file = options.output / f"{model.system}.safetensors"
    require_writable(file)
    if ranks.rank() == 0:
        precision.announce(config.mixed, device)

    train(
        options.dataset,
        options.output,
        model,
        config,
        progress=bar,
        device=device,
        begin_with=begin_with,
    )
    if ranks.rank():
        return None

    write_weights(options.output, options.dataset, file, device)
    return {"weights": str(file)}, f"Written to {file}"


def _validate(options: argparse.Namespace, bar: "_Bar") -> _Result:
    import torch

    from .data.held_out.real import real_test
    from .training.validation import BEST, recorded, said, validations

    torch.set_num_threads(options.processes)
    require_writable(options.training / BEST)
    for found in validations(
        options.training,
        options.dataset,
        real_test(options.folder, options.furniture, "choose"),
        every=options.every,
        processes=options.processes,
        progress=bar,
    ):
        if options.every is not None:
            _complain(said(found))

    rows = recorded(options.training)
    return rows, "\n".join(said(each) for each in rows)


def _cool(options: argparse.Namespace, _bar: "_Bar") -> _Result:
    from .training import ranks
    from .training.candidates import cooled

    device = ranks.device_of(options.device)
    require_writable(options.output / "weights")
    file = cooled(options.training, options.dataset, options.output, options.minutes, device)
    return {"weights": str(file)}, f"Written to {file}"


def _carry(options: argparse.Namespace, bar: "_Bar") -> _Result:
    from .data.dataset.packed import is_packed, pack, unpack

    source, output = options.folder, options.output
    if source.resolve() == output.resolve():
        raise InputError("What is carried goes to another folder than its own; name another.")

    require_writable(output / "dataset.json")
    if any(source.glob("*.checkpoint")):
        from .training.checkpoints import slim_run

        files = [str(file) for file in slim_run(source, output)]
        return {"files": files}, "\n".join(files)

    if is_packed(source):
        windows = unpack(source, output, bar)
    else:
        windows = pack(source, output, options.mebibytes, bar)

    return {"windows": windows}, f"{windows} windows written to {output}"


def _evaluate(options: argparse.Namespace, bar: "_Bar") -> _Result:
    from .core.weights import load_weights
    from .data.held_out.captured import held_out
    from .training.export import annotate
    from .training.plots import plot
    from .training.report import contact_sheets, report, text

    for folder in filter(None, (options.output, options.sheets)):
        require_writable(folder / "evaluation.json")

    if options.furniture:
        return _evaluate_among_real(options, bar)

    clips = held_out(options.folder)
    if _is_samp(options.weights):
        return _evaluate_samp(options, clips, bar)

    weights = load_weights(options.weights)
    found = report(weights, clips, bar)
    if options.save:
        rows = found["rows"]
        annotate(
            weights.path,
            {"ground_truth": json.dumps(rows["ground_truth"]), "held_out": json.dumps(rows)},
        )

    if options.output:
        save_text(options.output / "evaluation.json", json.dumps(found, indent=2))
        save_text(options.output / "evaluation.md", text(found))
        plot(found, options.output / "evaluation.png")
    if options.sheets:
        contact_sheets(weights, clips, options.sheets)

    return found, text(found)


def _is_samp(weights: Path | None) -> bool:
    return weights is not None and weights.suffix in (".checkpoint", ".pt")


def _evaluate_among_real(options: argparse.Namespace, bar: "_Bar") -> _Result:
    """The test among real furniture: seats by kind, maker and body."""
    from .core.weights import load_weights
    from .data.held_out.real import real_test
    from .data.held_out.walks import real_walks
    from .training.real_report import real_page, real_report, real_text

    if options.save or options.sheets:
        raise InputError(
            "The test among real furniture makes tables only; leave out --save and --sheets."
        )

    weights = load_weights(options.weights)
    found = real_report(
        weights,
        real_test(options.folder, options.furniture, options.role),
        bar,
        walks=real_walks(options.furniture, options.role),
    )
    if options.output:
        save_text(options.output / f"real-{options.role}.json", json.dumps(found, indent=2))
        title = f"Bodies and makers that {options.role}"
        save_text(options.output / f"real-{options.role}.md", real_page(found, title))

    return found, real_text(found)


def _evaluate_samp(options: argparse.Namespace, clips: "list[HeldClip]", bar: "_Bar") -> _Result:
    """A checkpoint of SAMP: only the rows, for each way to run its network."""
    from .baselines.samp_evaluate import measured_samp
    from .baselines.train import load_samp
    from .training.evaluate import rows, table

    if options.save or options.sheets or options.output:
        raise InputError(
            "A checkpoint of SAMP gives a table only; leave out --save, --sheets and --output."
        )

    kind, _ = load_samp(options.weights)
    found = {}
    for each in ("samp", "samp-a") if kind == "samp" else (kind,):
        found[each] = rows(measured_samp(options.weights, each, clips, bar))

    return found, "\n\n".join(f"## {name}\n\n{table(r)}" for name, r in found.items())


def _bench(options: argparse.Namespace, bar: "_Bar") -> _Result:
    module = _benchmark(_RESEARCH.get(options.name, options.name))
    if options.name in _MEASURES:
        found: _Result = module.measure(options.weights, bar)
        return found

    arguments = options.arguments[options.arguments[:1] == ["--"] :]
    text: str = module.main(arguments)
    return text, text


def _figures(options: argparse.Namespace, bar: "_Bar") -> _Result:
    others = {}
    for each in options.other:
        name, _, file = each.partition("=")
        if not file:
            raise InputError(f"'{each}' names no weights file; write it as NAME=FILE.")
        others[name] = Path(file)

    require_writable(options.output / "figure.png")
    files = [
        str(file)
        for file in _benchmark("figures").draw(
            options.output, options.weights, others, options.only, bar
        )
    ]
    return files, "\n".join(files)


def _benchmark(name: str) -> ModuleType:
    """A script in the folder of benchmarks, as a module that its processes can import as well."""
    checkout = str(Path(__file__).absolute().parents[1])
    if checkout not in sys.path:
        sys.path.insert(0, checkout)
    return importlib.import_module(f"benchmarks.{name}")


def _require(options: argparse.Namespace) -> None:
    """Raise InputError where the command is not part of this installation, or needs modules that
    are missing.
    """
    if not (Path(__file__).parent / options.part).is_dir():
        raise InputError(
            "This command is not part of the extension; run it from a checkout of the project."
        )

    missing = [_PACKAGES.get(name, name) for name in options.needs(options) if not _is_there(name)]
    if missing:
        inside = ", or run it inside Blender" if missing == ["bpy"] else ""
        raise InputError(
            f"This command needs {' and '.join(missing)}, which this Python does not have; "
            f"install it{inside}."
        )


def _is_there(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except (ImportError, ValueError):
        return False


class _Bar:
    """Progress for people, on standard error: a bar on a terminal, ten dots elsewhere. ``stop`` is
    called at every step.
    """

    def __init__(self, stop: Callable[[], None]) -> None:
        self.stop, self.dots, self.shown = stop, 0, False

    def __call__(self, progress: float) -> None:
        """Show the part done, in [0, 1]."""
        self.stop()
        part = min(max(progress, 0.0), 1.0)
        self.shown = True
        if sys.stderr.isatty():
            filled = "#" * int(30 * part)
            _complain(f"\r[{filled:.<30}] {100 * part:3.0f} %", end="")
        elif int(10 * part) > self.dots:
            _complain("." * (int(10 * part) - self.dots), end="")
            self.dots = int(10 * part)

    def __enter__(self) -> "_Bar":
        return self

    def __exit__(self, *_: object) -> None:
        if self.shown:
            _complain("")


@contextmanager
def _only_our_output() -> Iterator[None]:
    """A block in which what Blender itself prints on standard output goes to standard error, so
    that JSON stays JSON.
    """
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        with redirect_stdout(sys.stderr):  # what goes through Python; the rest is written by C
            yield
    finally:
        ctypes.CDLL("ucrtbase" if os.name == "nt" else None).fflush(None)
        os.dup2(kept, 1)
        os.close(kept)
