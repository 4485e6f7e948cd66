"""Arguments of widgets that only tell what they are given."""


def said(value):
    """An argument of a widget; what is called back or drawn in has no words."""
    if isinstance(value, dict):
        return {str(name): said(own) for name, own in value.items()}
    if isinstance(value, list | tuple):
        return [*map(said, value)]
    return value if isinstance(value, str | int | float | None) else "…"
