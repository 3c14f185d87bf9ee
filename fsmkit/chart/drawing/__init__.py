"""Diagrams: a Chart, or who sent what to whom, in; text or a picture out."""
