"""Findings and their locations: how every stage reports what is wrong, where, and how to fix it."""

from fsmkit.diagnostics.diagnostic import (
    Diagnostic,
    Findings,
    FsmkitError,
    Label,
    Policy,
    fail,
    render,
)
from fsmkit.diagnostics.fixes import Edit, Fix
from fsmkit.diagnostics.rules import Rule, Severity, rule, rules
from fsmkit.diagnostics.source import Source, Span, Text

__all__ = [
    "Diagnostic",
    "Edit",
    "Findings",
    "Fix",
    "FsmkitError",
    "Label",
    "Policy",
    "Rule",
    "Severity",
    "Source",
    "Span",
    "Text",
    "fail",
    "render",
    "rule",
    "rules",
]
