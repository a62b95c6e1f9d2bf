"""The command ``dafnet``: one parser behind ``python -m dafnet_addon …`` and ``blender [file] --command dafnet …``.

Results go to standard output, for machines with ``--json``; progress and errors go to standard error. Exit codes: 0
done, 1 an error said in one sentence, 2 a wrong command line, 130 stopped.
"""

import argparse
import ctypes
import importlib.util
import json
import os
import runpy
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .core.errors import DafnetError, InputError
from .core.take import MODES
from .core.text import printable
from .core.threads import cores

if TYPE_CHECKING:
    from .data.held_out import HeldClip

__all__ = ["main", "run"]

_SHOWN = 2000  # characters of each thing that ``info`` prints; --json gives all


def main(argv: Sequence[str] | None = None, in_blender: bool = False) -> int:
    """Run one command and return its exit code. ``in_blender``: the file that Blender has open is the scene."""
    try:
        options = _parser(in_blender).parse_args(argv)
        options.run(options)
    except SystemExit as stop:  # argparse has said why
        return int(stop.code or 0)
    except DafnetError as error:
        print(f"dafnet: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"dafnet: {error.filename or 'A file'} cannot be used ({error.strerror}); check its path.", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("dafnet: stopped.", file=sys.stderr)
        return 130
    return 0


def run() -> None:
    """``main`` as a console script."""
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    if "bpy" in sys.modules:
        # The module of Blender 4.2 crashes at exit once a property with a poll function was registered, unregistered or not.
        os._exit(code)
    sys.exit(code)


def _parser(in_blender: bool) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="dafnet", description="A character that walks up to furniture and uses it, from an animated root."
    )
    commands = parser.add_subparsers(metavar="command", required=True)

    def command(name: str, action: Callable[[argparse.Namespace], None], text: str) -> argparse.ArgumentParser:
        added = commands.add_parser(name, help=text, description=text)
        added.set_defaults(run=action, in_blender=in_blender)
        added.add_argument("--json", action="store_true", help="print the result as JSON on standard output")
        return added

    def sampling(added: argparse.ArgumentParser, temperature: float | None) -> None:
        added.add_argument("--seed", type=int, default=None if temperature is None else 0, help="seed of the noise")
        added.add_argument("--temperature", type=float, default=temperature, help="0 is the calm take, 1 as lively as real")
        added.add_argument("--weights", type=Path, metavar="FILE", help="trained weights; else those that ship")

    demo = command("demo", _demo, "build the example room, generate, bake, render a preview and report")
    demo.add_argument("-o", "--output", type=Path, default=Path("out/demo"), metavar="FOLDER")
    demo.add_argument("--no-preview", action="store_true", help="leave out the film and the contact sheet")
    sampling(demo, 0.0)

    bake = command("bake", _bake, "generate a character of a scene and save the scene with its keys")
    bake.add_argument("file", type=Path, nargs="?" if in_blender else None, metavar="FILE.blend")
    bake.add_argument("-o", "--output", type=Path, required=True, metavar="OUT.blend")
    bake.add_argument("--character", metavar="ARMATURE", help="needed where the scene has several characters")
    for name in ("root", "furniture", "head", "hand-left", "hand-right", "upper-body"):
        bake.add_argument(f"--{name}", metavar="NAME", help="overrules the character's own setting")
    bake.add_argument("--mode", choices=MODES, help="one mode for all frames")
    bake.add_argument("--frames", type=_frames, metavar="A:B", help="first and last frame")
    bake.add_argument("--plant-feet", type=float, metavar="SHARE", help="0 leaves feet as generated, 1 holds those that stand")
    bake.add_argument("--rest-on-seats", type=float, metavar="SHARE", help="0 leaves who sinks into a seat there")
    bake.add_argument("--reach-targets", type=float, metavar="SHARE", help="0 leaves hands as generated, 1 is exact")
    bake.add_argument("--clear-furniture", type=float, metavar="SHARE", help="1 brings hands and feet out of furniture")
    bake.add_argument("--smooth", type=float, metavar="SHARE", help="1 evens out quick changes")
    bake.add_argument("--takes", type=int, default=1, metavar="N", help="how many takes; the first one plays")
    sampling(bake, None)

    info = command("info", _info, "say what a weights file is")
    info.add_argument("weights", type=Path, nargs="?", metavar="WEIGHTS", help="else the weights that ship")

    prepare = command("prepare", _prepare, "make a training set from motion files, or go on making it")
    prepare.add_argument("folder", type=Path, metavar="FOLDER", help="holds the motion files")
    prepare.add_argument("-o", "--output", type=Path, required=True, metavar="DATASET")
    prepare.add_argument("--windows", type=int, default=12000, help="how many training windows")
    prepare.add_argument("--processes", type=int, default=cores())
    prepare.add_argument("--seed", type=int, default=0)

    train = command("train", _train, "train a model, or go on with a run, and write its weights")
    train.add_argument("config", type=Path, metavar="CONFIG.toml", help="sizes and budgets; see configs/")
    train.add_argument("dataset", type=Path, metavar="DATASET", help="made by 'prepare'")
    train.add_argument("-o", "--output", type=Path, required=True, metavar="RUN", help="folder of the run")
    train.add_argument("--minutes", type=float, help="of the flow's training, instead of the configuration's")
    train.add_argument("--from", dest="begin_with", type=Path, metavar="WEIGHTS", help="weights that a new run begins with")
    train.add_argument("--device", default="cpu", help="'cpu', or 'cuda'; several GPUs through torchrun")

    evaluate = command("evaluate", _evaluate, "measure weights on held-out clips, beside the clips themselves")
    evaluate.add_argument("folder", type=Path, metavar="FOLDER", help="holds the motion files")
    evaluate.add_argument("--weights", type=Path, metavar="FILE", help="trained weights; else those that ship")
    evaluate.add_argument("-o", "--output", type=Path, metavar="FOLDER", help="write evaluation.json, .md and .png there")
    evaluate.add_argument("--save", action="store_true", help="write the figures into the weights' metadata")
    evaluate.add_argument("--sheets", type=Path, metavar="FOLDER", help="also draw twenty clips, real beside generated")

    bench = command("bench", _bench, "measure: 'seats' sits on ten heights from three sides; 'speed' times every system")
    bench.add_argument("name", choices=["seats", "speed"])
    bench.add_argument("--weights", type=Path, metavar="FILE", help="trained weights; else those that ship")

    figures = command("figures", _figures, "draw the paper's figures with these weights")
    figures.add_argument("-o", "--output", type=Path, default=Path("out/figures"), metavar="FOLDER")
    figures.add_argument("--weights", type=Path, metavar="FILE", help="trained weights; else those that ship")
    figures.add_argument("--other", action="append", default=[], metavar="NAME=FILE", help="weights of another system")
    figures.add_argument("--only", nargs="+", metavar="NUMBER", help="the paper's numbers of the figures; else all")
    return parser


def _frames(text: str) -> tuple[int, int]:
    first, _, last = text.partition(":")
    try:
        return int(first), int(last)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}' is no range; write it as FIRST:LAST") from error


def _demo(options: argparse.Namespace) -> None:
    _require_bpy()
    from .blender.demo_room import run_demo

    with _only_our_output(), _Bar() as bar:
        report = run_demo(
            options.output, seed=options.seed, temperature=options.temperature,
            weights=options.weights, preview=not options.no_preview, progress=bar,
        )
    if options.json:
        print(json.dumps(report, indent=2))
        return
    for seat in report["seats"]:
        print(f"{seat['name']}: seat {seat['seat_height']:.2f} m, pelvis {seat['pelvis_height']:.3f} m, "
              f"{100 * seat['error']:+.1f} cm from where it should be")
    print(f"Written to {options.output}")


def _bake(options: argparse.Namespace) -> None:
    _require_bpy()
    from .blender.batch import bake_takes
    from .core.weights import load_weights

    if options.takes < 1:
        raise InputError("Ask for at least one take.")
    if options.output.suffix != ".blend":
        raise InputError(f"The output '{options.output}' has to end in .blend.")
    weights = load_weights(options.weights) if options.weights else None
    changes = {
        "root": options.root, "furniture": options.furniture, "head": options.head, "hand_left": options.hand_left,
        "hand_right": options.hand_right, "upper_body_source": options.upper_body, "mode": options.mode,
        "temperature": options.temperature, "seed": options.seed,
        "plant_feet": options.plant_feet, "rest_on_seats": options.rest_on_seats, "reach_targets": options.reach_targets,
        "clear_furniture": options.clear_furniture, "smooth": options.smooth,
    }
    if options.frames:
        changes["frame_start"], changes["frame_end"] = options.frames
    with _only_our_output(), _Bar() as bar:
        result = bake_takes(
            options.file, options.output, character=options.character, takes=options.takes, weights=weights, progress=bar,
            changes={name: value for name, value in changes.items() if value is not None},
        )
    report: dict[str, Any] = {
        "output": str(options.output),
        "takes": [
            {
                "action": action.name, "seed": draw.seed, "temperature": draw.temperature, "frames": len(take),
                "log_likelihood": round(take.log_likelihood, 3), "metrics": take.metrics, "raw_metrics": take.raw_metrics,
            }
            for action, draw, take in zip(result.actions, result.draws, result.takes, strict=True)
        ],
        "warnings": list(result.warnings),
        "seconds": {stage: round(spent, 4) for stage, spent in result.seconds.items()},
    }
    if options.json:
        print(json.dumps(report, indent=2))
        return
    for warning in report["warnings"]:
        print(f"Warning: {warning}")
    for take in report["takes"]:
        slides = take["metrics"]["foot_sliding_per_frame"]
        print(f"{take['action']}: {take['frames']} frames, seed {take['seed']}, {slides:.2f} feet slide a frame")
    print(", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in report["seconds"].items()))
    print(f"Written to {options.output}")


def _info(options: argparse.Namespace) -> None:
    from .core.weights import load_weights

    weights = load_weights(options.weights)
    described: dict[str, Any] = {
        "file": str(weights.path), "bytes": weights.path.stat().st_size,
        "parameters": sum(int(tensor.size) for tensor in weights.tensors.values()),
    }
    described |= {key: weights.says(key) for key in sorted(weights.metadata) if key not in described}
    if options.json:
        print(json.dumps(described, indent=2))
        return
    for key, value in described.items():
        print(f"{printable(key)}: {printable(value if isinstance(value, str) else json.dumps(value), _SHOWN)}")


def _prepare(options: argparse.Namespace) -> None:
    _require_checkout("data")
    from .data.prepare import prepare

    with _Bar() as bar:
        prepare(options.folder, options.output, options.windows, options.processes, options.seed, bar)
    if options.json:
        print((options.output / "dataset.json").read_text(encoding="utf-8"))
    else:
        for report in ("summary.txt", "fits.txt"):
            print((options.output / report).read_text(encoding="utf-8"), end="")
        print(f"Written to {options.output}; look at its preview.png")


def _train(options: argparse.Namespace) -> None:
    _require_checkout("training")
    from .core.weights import load_weights
    from .training import precision, ranks
    from .training.export import export
    from .training.spread import take_spread
    from .training.train import account, dataset_pool, read_config, train, trained

    model, config = read_config(options.config)
    if options.minutes is not None:
        config = replace(config, minutes_flow=options.minutes)
    begin_with = load_weights(options.begin_with) if options.begin_with else None
    if ranks.rank() == 0:
        precision.announce(config.mixed, options.device)
    with _Bar() as bar:
        train(options.dataset, options.output, model, config, bar, options.device, begin_with)
    if ranks.rank():
        return
    file = options.output / f"{model.system}.safetensors"
    flow, predictor, statistics = trained(options.output)
    spread = take_spread(flow, predictor, dataset_pool(options.dataset), statistics)
    export(file, flow, predictor, statistics, account(options.output, options.dataset), spread)
    print(json.dumps({"weights": str(file)}) if options.json else f"Written to {file}")


def _evaluate(options: argparse.Namespace) -> None:
    _require_checkout("training")
    from .core.weights import load_weights
    from .data.held_out import held_out
    from .training.export import annotate
    from .training.plots import plot
    from .training.report import contact_sheets, report, text

    clips = held_out(options.folder)
    if options.weights and options.weights.suffix in (".checkpoint", ".pt"):
        _evaluate_samp(options, clips)
        return
    weights = load_weights(options.weights)
    with _Bar() as bar:
        found = report(weights, clips, bar)
    if options.save:
        rows = found["rows"]
        annotate(weights.path, {"ground_truth": json.dumps(rows["ground_truth"]), "held_out": json.dumps(rows)})
    if options.output:
        options.output.mkdir(parents=True, exist_ok=True)
        (options.output / "evaluation.json").write_text(json.dumps(found, indent=2), encoding="utf-8")
        (options.output / "evaluation.md").write_text(text(found) + "\n", encoding="utf-8")
        plot(found, options.output / "evaluation.png")
    if options.sheets:
        contact_sheets(weights, clips, options.sheets)
    print(json.dumps(found, indent=2) if options.json else text(found))


def _evaluate_samp(options: argparse.Namespace, clips: "list[HeldClip]") -> None:
    """A checkpoint of SAMP's: the rows alone, of each way that its network runs."""
    from .baselines.samp_evaluate import measured_samp
    from .baselines.train import load_samp
    from .training.evaluate import rows, table

    if options.save or options.sheets or options.output:
        raise InputError("Of a checkpoint of SAMP's only the table is made; leave out --save, --sheets and --output.")
    kind, _ = load_samp(options.weights)
    found = {}
    for each in ("samp", "samp-a") if kind == "samp" else (kind,):
        with _Bar() as bar:
            found[each] = rows(measured_samp(options.weights, each, clips, bar))
    print(json.dumps(found, indent=2) if options.json else "\n\n".join(f"## {name}\n\n{table(r)}" for name, r in found.items()))


def _bench(options: argparse.Namespace) -> None:
    measure = _benchmark(options.name)["measure"]
    with _Bar() as bar:
        report, summary = measure(options.weights, bar)
    print(json.dumps(report, indent=2) if options.json else summary)


def _figures(options: argparse.Namespace) -> None:
    _require_bpy()
    others = {}
    for each in options.other:
        name, _, file = each.partition("=")
        if not file:
            raise InputError(f"'{each}' names no weights; write it as NAME=FILE.")
        others[name] = Path(file)
    draw = _benchmark("figures")["draw"]
    with _only_our_output(), _Bar() as bar:
        files = draw(options.output, options.weights, others, options.only, bar)
    print(json.dumps([str(file) for file in files]) if options.json else "\n".join(str(file) for file in files))


def _benchmark(name: str) -> dict[str, Any]:
    """What a script of the folder of benchmarks defines."""
    _require_checkout("../benchmarks")
    return runpy.run_path(str(Path(__file__).parents[1] / "benchmarks" / f"{name}.py"))


def _require_checkout(folder: str) -> None:
    if not (Path(__file__).parent / folder).is_dir():
        raise InputError("This command is not part of the extension; run it from a checkout of the project.")


def _require_bpy() -> None:
    if importlib.util.find_spec("bpy") is None:
        raise InputError("This command needs Blender's Python module; install it, or run it inside Blender.")


class _Bar:
    """Progress for people, on standard error: a bar on a terminal, ten dots elsewhere."""

    def __init__(self) -> None:
        self.dots = 0

    def __call__(self, progress: float) -> None:
        """Show the part done, in [0, 1]."""
        part = min(max(progress, 0.0), 1.0)
        if sys.stderr.isatty():
            filled = "#" * int(30 * part)
            print(f"\r[{filled:.<30}] {100 * part:3.0f} %", end="", file=sys.stderr, flush=True)
        elif int(10 * part) > self.dots:
            print("." * (int(10 * part) - self.dots), end="", file=sys.stderr, flush=True)
            self.dots = int(10 * part)

    def __enter__(self) -> "_Bar":
        return self

    def __exit__(self, *_: object) -> None:
        print(file=sys.stderr, flush=True)


@contextmanager
def _only_our_output() -> Iterator[None]:
    """Send what Blender itself prints on standard output to standard error, so that JSON stays JSON."""
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
