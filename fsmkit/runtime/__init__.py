"""Run a Chart or a System: the reference interpreter, sessions, clocks, links and traces.

The package also holds the C, Python and JavaScript libraries of generated machines. The
interpreter imports neither `chart.analysis` nor `plan`.
"""
