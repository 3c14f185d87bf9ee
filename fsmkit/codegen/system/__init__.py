"""Systems in C: a System or a Deployment in, the C that joins its machines out.

What its direct connections do, and what crosses from one node to another.
"""
