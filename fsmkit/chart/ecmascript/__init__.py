"""The loose dialects: a Document in which types and names are implied in, a plainer Document out.

Passes that only ECMAScript needs. What cannot be decided before a machine runs is a finding.
"""
