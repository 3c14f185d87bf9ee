"""Locate the installed folders of the libraries that generated machines use."""

from pathlib import Path

C_LIBRARY = Path(__file__).parent / "c"
JAVASCRIPT_LIBRARY = Path(__file__).parent / "javascript"
PYTHON_LIBRARY = Path(__file__).parent / "python"
