"""Checks of a figure of matplotlib: no words overlap."""

from __future__ import annotations

from matplotlib.backends.backend_agg import FigureCanvasAgg


def nothing_overlaps(figure):
    boxes = texts(figure)
    for i, (words, box) in enumerate(boxes):
        for other, against in boxes[:i]:
            assert not box.overlaps(against), (words, other)


def texts(figure):
    """Bounding boxes of all words, by what they say."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    found = []
    for axes in figure.axes:
        shown = [axes.title, axes._left_title, axes.xaxis.label, axes.yaxis.label]
        if axes.get_legend():
            shown += axes.get_legend().get_texts()
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            ticks = [t for t in axis.get_major_ticks() if low <= t.get_loc() <= high]
            shown += [label for t in ticks for label in (t.label1, t.label2)]
        found += [t for t in shown if t.get_text() and t.get_visible()]
    found.append(figure._suptitle)
    boxes = [(t.get_text(), t.get_window_extent(canvas.get_renderer())) for t in found]
    width, height = canvas.get_width_height()
    for words, box in boxes:
        assert box.x0 >= -1 and box.x1 <= width + 1, words
        assert box.y0 >= -1 and box.y1 <= height + 1, words
    return boxes
