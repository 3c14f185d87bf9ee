"""The properties and the environment of a chart, as texts."""

from __future__ import annotations

from fsmkit.document.document import DocEnvironment, DocProperty


def property_parts(asked: DocProperty) -> list[str]:
    """Return conditions and duration in their order."""
    return [text.value for text in (asked.first, asked.time, asked.then) if text is not None]


def spell_property(asked: DocProperty) -> str:
    """Return a property on one line: its name, its kind, and what it is about."""
    parts = [asked.kind.value, ", ".join(property_parts(asked))]
    watched = [f"watch {text}" for text in asked.watch]
    return f"{asked.name}: {' '.join(part for part in parts if part)}" + "".join(
        f"; {one}" for one in watched
    )


def environment_parts(environment: DocEnvironment) -> dict[str, list[str]]:
    """Return what may and what will come, without what is empty."""
    parts = {"may": environment.may, "will": environment.will}
    return {key: [text.value for text in texts] for key, texts in parts.items() if texts}
