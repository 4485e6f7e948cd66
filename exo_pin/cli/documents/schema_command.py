"""``exo-pin schema``: what documents hold, as JSON schemas."""

from __future__ import annotations

from json import dumps, loads
from typing import Annotated

from ...core.errors import FileFormatError
from ...core.files.atomic import read_text
from ...core.schema import checked_identifier, identifier
from ..command import Files, writes
from ..options import called
from .registry import DOCUMENTS, kind_of
from .registry import schema as schema_named


@writes(".json", json=False)
def schema(name: Annotated[str | None, called("NAME|FILE.json")] = None, /, *, files: Files = Files()) -> None:
    """Print the JSON schema of a document that --json prints, with descriptions and units; without a name list them.

    Of a .json file say which document it is; one of another version is refused.

    Parameters
    ----------
    name : str, optional
        Of the schema, as in "schema": "exo_pin.NAME/1"; or a file that --out or --json has written.

    Examples
    --------
    exo-pin schema
    exo-pin schema reaction
    """
    if name is None:
        width = max(map(len, DOCUMENTS)) + 2
        print("\n".join(f"{each:{width}}{_summary(each)}" for each in DOCUMENTS))
    elif name.lower().endswith(".json"):
        try:
            document = loads(read_text(name))
        except ValueError as error:
            raise FileFormatError(f"is no JSON: {error}", name) from error
        found = checked_identifier(document, list(DOCUMENTS))
        print(f"{identifier(found)}: {_summary(found)}")
    else:
        made = schema_named(name)
        files.deliver(dumps(made, indent=2, ensure_ascii=False), data=lambda: made)


def _summary(name: str) -> str:
    """What a document is, in a line."""
    return " ".join((kind_of(name).__doc__ or "").split("\n\n")[0].split())
