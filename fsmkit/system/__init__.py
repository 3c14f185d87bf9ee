"""Systems and deployments: system files in, a System or a Deployment out.

Machines, connections, environment, shared data, schedule and properties, each with its place. From
here on all names are bound to machines, events and values, and types on both ends agree.
"""
