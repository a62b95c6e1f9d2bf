#!/usr/bin/env bash
# Trains on a machine with a GPU and without a network, within so many minutes, from a dataset that was made small enough to be
# carried there (dafnet carry DATASET -o PACKED). It needs a Python of 3.11 or later with torch and NumPy, and nothing else. What is
# worth carrying back is in OUT: slim checkpoints, the weights, the log; what is over 16 MiB in parts of that size (cat joins them).
#
#     scripts/train_on_gpu.sh PACKED -o OUT [--minutes 10] [--batch 256] [--config configs/main.toml] [--set NAME=VALUE]...
#                             [--device cuda] [--from WEIGHTS] [--resume OUT] [--work FOLDER]
#
# --minutes: of the training, a tenth of them the predictor's; loading and writing come on top, a minute or two. Given again, with
# more minutes, the command goes on with what is in the work folder; or, on another machine, with what an earlier one carried back.
# Stopped from outside it still leaves its last checkpoints. --set: any setting of a configuration, as width=384 or save_every=50.
set -euo pipefail

usage() { sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "$0" >&2; exit 2; }

here=$(cd "$(dirname "$0")/.." && pwd)
packed='' out='' minutes=10 batch=256 config=$here/configs/main.toml device=cuda begin_with='' resume='' work='' settings=()
while (($#)); do
    case $1 in
        -o | --minutes | --batch | --config | --set | --device | --from | --resume | --work) (($# > 1)) || usage ;;&
        -o) out=$2 ;;
        --minutes) minutes=$2 ;;
        --batch) batch=$2 ;;
        --config) config=$2 ;;
        --set) settings+=(--set "$2") ;;
        --device) device=$2 ;;
        --from) begin_with=$2 ;;
        --resume) resume=$2 ;;
        --work) work=$2 ;;
        -*) usage ;;
        *) [[ -z $packed ]] || usage; packed=$1; shift; continue ;;
    esac
    shift 2
done
[[ -n $packed && -n $out && $minutes =~ ^[0-9]*\.?[0-9]+$ ]] || usage

python=${PYTHON:-python3}
if ! "$python" -c 'import sys, numpy, torch; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
    echo "'$python' is no Python of 3.11 or later with torch and NumPy; name one: PYTHON=path/to/python $0" >&2
    exit 1
fi
dafnet() { PYTHONPATH=$here${PYTHONPATH:+:$PYTHONPATH} exec "$python" -m dafnet_addon "$@"; }

[[ -n $work ]] || work=$out-work
run=$work/run
mkdir -p "$out" "$run"
if [[ -n $resume && ! -e $run/log.jsonl ]]; then
    for file in "$resume"/*; do
        case $file in
            *.part-00) cat "${file%00}"* >"$run/$(basename "${file%.part-00}")" ;;
            *.checkpoint | *.jsonl) cp "$file" "$run/" ;;
        esac
    done
fi

carry_back() {
    (dafnet carry "$run" -o "$out") >/dev/null || return
    local file
    for file in "$out"/*; do
        [[ $file == *.part-* ]] && continue
        rm -f "$file".part-*
        if (($(stat -c %s "$file") > 16 << 20)); then
            split -b 16M -d "$file" "$file.part-" && rm "$file"
        fi
    done
    ls -l "$out"
}

(dafnet carry "$packed" -o "$work/dataset")
budget=(--set "minutes_predictor=$(awk "BEGIN { print 0.1 * $minutes }")" --set "minutes_flow=$(awk "BEGIN { print 0.9 * $minutes }")")
(dafnet train "$config" "$work/dataset" -o "$run" --device "$device" ${begin_with:+--from "$begin_with"} \
    --set "batch=$batch" "${budget[@]}" "${settings[@]}") &
training=$!
trap 'kill -INT $training 2>/dev/null || true' INT TERM
code=0
wait $training || code=$?
# A wait that a signal cuts short leaves the training to end by itself.
if kill -0 $training 2>/dev/null; then wait $training || code=$?; fi
carry_back
exit $code
