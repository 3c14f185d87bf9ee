"""Inheritance: a Document and those of its bases in, one Document out.

What a derived chart leaves open is as the base has it; nothing else of the base is changed.
"""
