"""Deployments: which machine of a system runs on which node, and what joins the nodes."""
