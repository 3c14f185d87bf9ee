"""Statements and declarations: text in; the statements of a Document out, expressions unread."""
