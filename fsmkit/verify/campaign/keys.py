"""The keys of a campaign file, for the reader and the JSON Schema."""

from __future__ import annotations

from fsmkit.document.keys import Keys, named

CAMPAIGN = named(
    campaign="its name",
    doc="a description",
    runs="a list of runs; the first key is the kind: check, mutants, swarm, differential, fuzz",
)
_EXPLORING = named(
    set="parameters by name; of a list, or a range such as 1..8, each value in turn",
    property="the properties to evaluate, a name or a list (default: all)",
    time="zones, discrete or untimed",
    silent="whether watchdogs are assumed to be silent; needs untimed",
    engine="c or python; Python is quicker where a system is so small that compiling is most of it",
    timeout="stop each check after this much time, such as 60s",
    memory="the memory limit of each check, such as 2G",
)
CHECK: Keys = {**named(check="systems or charts: a path, a pattern, or a list"), **_EXPLORING}
MUTANTS: Keys = {
    **named(
        mutants="systems or charts whose mutants are evaluated: a path, a pattern, or a list",
        count="how many changes of each are tried (default: all)",
        seed="seed of the order in which they are tried",
    ),
    **_EXPLORING,
}
SWARM: Keys = {
    **named(
        swarm="systems or charts, searched with several seeds: a path, a pattern, or a list",
        seeds="how many seeds, or a list or a range of them",
        storage="what is kept of a state: bitstate or hash-compact",
    ),
    **_EXPLORING,
}
DIFFERENTIAL = named(
    charts="how many random charts are compared",
    seed="which of them",
    targets="the targets to compare with the interpreter (default: all)",
)
FUZZ = named(
    target="what is fuzzed: yaml, scxml, expressions or records",
    seconds="for how long",
    seed="of the chance",
)
RUNS: dict[str, Keys] = {
    "check": CHECK,
    "mutants": MUTANTS,
    "swarm": SWARM,
    "differential": named(differential="random charts: interpreter and targets compared"),
    "fuzz": named(fuzz="changed charts and texts through the front ends, guided by coverage"),
}
"""By its first key, the keys of a run."""
WITHIN: dict[str, Keys] = {"differential": DIFFERENTIAL, "fuzz": FUZZ}
"""The keys under that first key, where it has some."""
FUZZED = ("yaml", "scxml", "expressions", "records")
ENGINES = ("c", "python")
LOSSY = ("bitstate", "hash-compact")
