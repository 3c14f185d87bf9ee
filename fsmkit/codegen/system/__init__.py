"""Systems in C: from a System or a Deployment to the C that joins its machines.

It implements direct connections, and the connections between nodes.
"""
