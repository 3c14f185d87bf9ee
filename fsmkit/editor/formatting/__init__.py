"""Files in their usual layout: from text to text, nothing is read or written beside."""

from __future__ import annotations

from pathlib import PurePath

from fsmkit.editor.formatting.xml_text import formatted_xml
from fsmkit.editor.formatting.yaml_text import formatted_yaml

XML = frozenset({".scxml", ".xml"})

__all__ = ["formatted"]


def formatted(text: str, name: str) -> str:
    """Return the text of a chart, a system, a deployment or the like in its usual layout.

    Args:
        text: What the file holds.
        name: The name of the file, for findings; its suffix says whether it is XML or YAML.

    Returns:
        The text with its keys in order, with usual white space, and with every comment. It says
        the same and is returned as it is when it is formatted again. A YAML file of another kind
        is returned as it is.

    Raises:
        FsmkitError: With every finding, where the text cannot be read; ``not-formatted`` where it
            cannot be laid out without a change of its meaning.

    """
    plain = text.replace("\r\n", "\n")
    is_xml = PurePath(name).suffix.lower() in XML
    made = formatted_xml(plain, name) if is_xml else formatted_yaml(plain, name)
    return made.replace("\n", "\r\n") if "\r\n" in text else made
