"""Random charts: convert decisions (`choices`) to Documents, systems and scripts.

Every chart is valid by construction, and its runs end.
"""
