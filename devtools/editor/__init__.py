"""Campaigns against the language server: every name renamed, texts edited at random."""
