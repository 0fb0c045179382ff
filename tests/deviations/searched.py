"""What a search of trials out of limit draws and finds, answered by a response."""

from scipy.special import ndtri


def led(course, margin):
    """Return the normal scores of all stages of a search, and what it returns."""
    drawn, stage = [], next(course)
    while True:
        drawn.append(ndtri(stage.unit))
        try:
            stage = course.send(margin(drawn[-1]))
        except StopIteration as end:
            return drawn, end.value
