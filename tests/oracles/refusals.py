"""What questions that cannot be answered are refused with."""

import exo_pin as ep


def refused(*questions):
    """Kind and words of the error of each question, or what it is answered with if it has none."""
    return [_of(question) for question in questions]


def _of(question):
    try:
        return question()
    except (ep.ExoPinError, TypeError, ValueError) as error:
        return f"{type(error).__name__}: {' '.join(str(error).split())}"
