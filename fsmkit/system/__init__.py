"""Read system files and deployments; return a `System` or a `Deployment`.

A System holds machines, connections, environment, shared data, schedule and properties, each with
its location. All names are resolved, and the types at both ends of each connection agree.
"""
