"""The properties and the environment of a chart, as texts."""

from __future__ import annotations

from fsmkit.document.document import DocEnvironment, DocProperty


def property_parts(declared: DocProperty) -> list[str]:
    """Return conditions and duration in their order."""
    return [
        text.value for text in (declared.first, declared.time, declared.then) if text is not None
    ]


def format_property(declared: DocProperty) -> str:
    """Return a property on one line: its name, its kind, its conditions and duration."""
    parts = [declared.kind.value, ", ".join(property_parts(declared))]
    watched = [f"watch {text}" for text in declared.watch]
    return f"{declared.name}: {' '.join(part for part in parts if part)}" + "".join(
        f"; {one}" for one in watched
    )


def environment_parts(environment: DocEnvironment) -> dict[str, list[str]]:
    """Return the non-empty lists of an environment by key, `may` and `will`."""
    parts = {"may": environment.may, "will": environment.will}
    return {key: [text.value for text in texts] for key, texts in parts.items() if texts}
