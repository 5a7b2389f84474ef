"""What a map carries of its definition, as plain values: nothing that it names is followed, and nothing is run."""

from collections.abc import Mapping

from sweeps.schema.reading import MAX_FILE_BYTES, plain, read_text
from sweeps.schema.refusals import DefinitionError, UnreadableError

CONTRACT_VERSION = "2.0"
DEFAULT_SYSTEM = "rigid_body"  # of a definition, or a map, that names none


def definition_of(attributes: Mapping) -> dict:
    """The plain values of the definition among a map's attributes; none where it carries none that can be read."""
    try:
        return mapping_of(attributes.get("definition", ""))
    except (DefinitionError, UnreadableError):
        return {}


def mapping_of(text: object) -> dict:
    """The plain values of a definition's text, which may be anything.

    Raises:
        DefinitionError: for what is no text of a reasonable length, or no mapping.
        UnreadableError: for what cannot be read as YAML.
    """
    if not isinstance(text, str) or len(text) > MAX_FILE_BYTES:
        raise DefinitionError("is no text of a definition")
    values = plain(read_text(text))
    if not isinstance(values, dict):
        raise DefinitionError("is no mapping")
    return values
