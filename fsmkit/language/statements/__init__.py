"""Statements and declarations of a Document, read from text with unread expressions."""
