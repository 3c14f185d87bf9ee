"""Comparing an imported chart with the tool that it comes from, and with its generated C."""
