"""Deployments: the node of each machine of a system, and the links between nodes."""
