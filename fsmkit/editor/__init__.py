"""The language server for editors, and its index of names.

Files are only parsed: nothing that they name is imported or run. While a file does not parse, the
server uses its last version that did.
"""
