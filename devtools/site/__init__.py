"""The documentation as a site: ``python -m devtools.site OUT``, by Sphinx with the theme Furo."""
