"""Campaigns on machines of other tools: rewritings, damaged files, corpora."""
