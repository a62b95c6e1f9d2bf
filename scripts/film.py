#!/usr/bin/env python3
"""Joins pictures into a film that pages and READMEs show: an animated WebP.

    scripts/film.py out/cafe/truth/frames/*.png -o docs/films/cafe.webp --seconds 22

The pictures are joined as they are named, as ``dafnet populate --render frames`` and
``scripts/window.sh … films`` write them. Needs Pillow.
"""

import argparse
import sys
from pathlib import Path

from PIL import Image


def film(
    pictures: list[Path],
    out: Path,
    *,
    seconds: float,
    width: int,
    quality: int,
    crop: tuple[int, int, int, int] | None,
) -> None:
    """Write ``pictures`` as a film of ``seconds`` that begins anew, ``width`` pixels wide, of the
    part of them between the pixels ``crop``.
    """
    images = []
    for picture in pictures:
        image = Image.open(picture).convert("RGB").crop(crop)
        size = (width, round(image.height * width / image.width))
        images.append(image.resize(size, Image.Resampling.LANCZOS))

    out.parent.mkdir(parents=True, exist_ok=True)
    images[0].save(
        out,
        save_all=True,
        append_images=images[1:],
        duration=round(1000.0 * seconds / len(images)),
        loop=0,
        quality=quality,
        method=6,
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pictures", type=Path, nargs="+", metavar="PICTURE")
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--seconds", type=float, required=True, help="of the whole film")
    parser.add_argument("--width", type=int, default=720, help="pixels")
    parser.add_argument("--quality", type=int, default=60, help="0 to 100")
    parser.add_argument(
        "--crop", type=int, nargs=4, metavar=("LEFT", "TOP", "RIGHT", "BOTTOM"), help="pixels"
    )
    options = parser.parse_args()

    missing = [picture for picture in options.pictures if not picture.is_file()]
    if missing:
        sys.exit(f"There is no picture '{missing[0]}'.")
    film(
        options.pictures,
        options.output,
        seconds=options.seconds,
        width=options.width,
        quality=options.quality,
        crop=options.crop and tuple(options.crop),
    )
    size = options.output.stat().st_size / 1e6
    print(f"{options.output}: {len(options.pictures)} pictures, {size:.1f} MB")


if __name__ == "__main__":
    main()
