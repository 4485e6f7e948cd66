"""Whether what is written on a figure can be read."""


def assert_words_are_apart(figure):
    """No two texts of a figure overlap by more than a pixel, and all are on it."""
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    words = []
    for axes in figure.axes:
        legend = axes.get_legend()
        words += [*axes.texts, axes.title, axes.xaxis.label, axes.yaxis.label, *(legend.get_texts() if legend else ())]
        for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            # Ticks beyond the limits are there and not drawn.
            ticks = [tick for tick in axis.get_major_ticks() if min(low, high) <= tick.get_loc() <= max(low, high)]
            words += [tick.label1 for tick in ticks]
    boxes = [
        (text.get_text(), text.get_window_extent(renderer)) for text in words if text.get_visible() and text.get_text()
    ]
    width, height = figure.canvas.get_width_height()
    for i, (text, box) in enumerate(boxes):
        assert box.x0 >= -1, text
        assert box.x1 <= width + 1, text
        assert -1 <= box.y0 < box.y1 <= height + 1, text
        for other, there in boxes[:i]:
            wide = min(box.x1, there.x1) - max(box.x0, there.x0)
            high = min(box.y1, there.y1) - max(box.y0, there.y0)
            assert wide <= 1 or high <= 1, (text, other)
