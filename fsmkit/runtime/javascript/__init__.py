"""The part of JavaScript machines that does not depend on a chart: read as text, never imported."""
