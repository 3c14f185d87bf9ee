"""Questions of a client: values, why, what an event would do, where something happened.

Pure functions of moments and charts; nothing in here changes a session.
"""
