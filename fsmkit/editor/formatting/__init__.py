"""Format files: functions from source to source, without access to files."""

from __future__ import annotations

from pathlib import PurePath

from fsmkit.editor.formatting.xml_text import format_xml
from fsmkit.editor.formatting.yaml_text import format_yaml

XML = frozenset({".scxml", ".xml"})

__all__ = ["formatted"]


def format_source(text: str, name: str) -> str:
    """Return the source of a chart, a system, a deployment and so on in the usual format.

    Args:
        text: The source.
        name: The file name, for findings; its suffix selects XML or YAML.

    Returns:
        The source with ordered keys, usual white space, and all comments. It has the same
        meaning, and formatting it again changes nothing. A YAML file of another kind is unchanged.

    Raises:
        FsmkitError: With every finding if the source cannot be read; ``not-formatted`` if
            formatting would change its meaning.

    """
    plain = text.replace("\r\n", "\n")
    is_xml = PurePath(name).suffix.lower() in XML
    made = format_xml(plain, name) if is_xml else format_yaml(plain, name)
    return made.replace("\n", "\r\n") if "\r\n" in text else made
