"""A scene as a GIF that repeats."""

import io
from collections.abc import Sequence

from matplotlib.font_manager import findfont
from PIL import Image, ImageDraw, ImageFont

from tolstat.document.scene import FRAME, ROW, WIDE, Scene
from tolstat.literal import visible
from tolstat.render.colours import INK, ROLES
from tolstat.render.moving import GREY, HALF, MIDDLE, NUMBERS, TEXT

PIXELS = 720  # of its width
FINER = 2  # times as many are drawn, for smooth lines
DOT = -45, -45, 45, 45  # ends of a joint
EDGE = 120  # beside all
SCALE = FINER * PIXELS / (WIDE + 2 * EDGE)


def gif(scene: Scene, title: str) -> bytes:
    """Return all frames as a GIF, with a title."""
    font = ImageFont.truetype(findfont("DejaVu Sans"), round(SCALE * TEXT))
    first, *others = (_frame(scene, title, i, font) for i in range(len(scene.points)))
    buffer = io.BytesIO()
    first.save(
        buffer, "GIF", save_all=True, append_images=others, loop=0,
        duration=round(1000 * FRAME),
    )  # fmt: skip
    return buffer.getvalue()


def _frame(
    scene: Scene, title: str, number: int, font: ImageFont.FreeTypeFont
) -> Image.Image:
    """Return one frame."""
    top = 2 * TEXT
    high = top + scene.height + 2 * TEXT + ROW * len(scene.bars) + ROW // 2
    size = FINER * PIXELS, round(SCALE * high)
    image = Image.new("RGB", size, "white")
    draw = ImageDraw.Draw(image)

    def line(points: Sequence[Sequence[int]], colour: str, thick: int) -> None:
        places = [(SCALE * (x + EDGE), SCALE * (y + top)) for x, y in points]
        draw.line(places, colour, max(round(SCALE * thick), 1), "curve")

    def write(x: int, y: int, words: str, anchor: str = "ls") -> None:
        place = SCALE * (x + EDGE), SCALE * (y + top)
        draw.text(place, visible(words), INK, font, anchor)

    write(0, TEXT - top, title)
    for corners in scene.ground:
        line(corners.tolist(), INK, 12)
    layers = [] if scene.nominal is None else [scene.nominal]
    for frames in (*layers, scene.points):
        grey = frames is scene.nominal
        for part in scene.lines:
            joined = frames[number][[*part.points]].tolist()
            line(joined, GREY if grey else ROLES[part.colour], 36 if grey else 30)
            for x, y in joined if part.joints and not grey else ():
                place = [x + EDGE, y + top, x + EDGE, y + top]
                ends = [SCALE * (c + d) for c, d in zip(place, DOT, strict=True)]
                draw.ellipse(ends, ROLES[part.colour])
    below = scene.height + TEXT
    write(0, below, scene.words)
    write(WIDE, TEXT, scene.labels[number], "rs")
    for i, bar in enumerate(scene.bars):
        y = below + TEXT + ROW * i + ROW // 2
        write(0, y + TEXT // 3, bar.name)
        write(NUMBERS, y + TEXT // 3, bar.words[number])
        for values, colour, thick in (
            (bar.nominal, GREY, 150), (bar.lengths, ROLES[bar.colour], 80)
        ):  # fmt: skip
            if values is not None:
                end = MIDDLE + HALF * int(values[number]) // 1000
                line([(MIDDLE, y), (end, y)], colour, thick)
        line([(MIDDLE, y - ROW // 2), (MIDDLE, y + ROW // 2)], INK, 8)
    small = image.resize((PIXELS, round(size[1] / FINER)), Image.Resampling.BOX)
    return small.quantize(64)
