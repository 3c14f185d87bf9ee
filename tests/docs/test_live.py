"""The page on the protocol names each message and each command with its keys."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import msgspec
import pytest

from fsmkit.inspector import commands
from fsmkit.runtime.live import messages

PAGE = (Path(__file__).parents[2] / "docs/reference/live.md").read_text(encoding="utf-8")
KINDS = (*get_args(messages.AnyMessage), *get_args(commands.AnyCommand))


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__module__[-8:] + kind.__name__)
def test_a_kind_is_described(kind: type[msgspec.Struct]) -> None:
    tag = kind.__struct_config__.tag
    rows = [line for line in PAGE.splitlines() if line.startswith(f"| `{tag}` |")]
    keys = [field.encode_name for field in msgspec.structs.fields(kind)]
    assert any(all(f"`{key}`" in row for key in keys if key != "id") for row in rows)


def test_the_names_of_commands_are_those_there_are() -> None:
    tags = [kind.__struct_config__.tag for kind in get_args(commands.AnyCommand)]
    assert sorted(tags) == sorted(commands.NAMES)
