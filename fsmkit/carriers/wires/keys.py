"""The keys of the file of a board."""

from __future__ import annotations

from fsmkit.document.keys import Form, Key, named

WIRES = {
    "digital_in": named(
        digital_in="its number",
        active="high or low; high unless it says so",
        debounce="the debounce time",
        host="true: the program of the board reads it, too",
    ),
    "counter": named(
        counter="its number",
        bits="1 to 32, after which it is 0 again; 32 unless it says so",
        host="true: the program of the board reads it, too",
    ),
    "analog_in": named(
        analog_in="its number",
        bits="1 to 24 of the converter; 12 unless it says so",
        signed="true: in two's complement",
        scale="raw values and what they mean; straight lines between them",
        lowpass="the time constant of a filter of first order",
        valid="the raw values `least..greatest` that a sound sensor gives",
        host="true: the program of the board reads it, too",
    ),
    "number_in": named(
        number_in="its number",
        range="`least..greatest`",
        host="true: the program of the board reads it, too",
    ),
    "digital_out": named(
        digital_out="its number", active="high or low", safe="on or off; off unless it says so"
    ),
    "pwm": named(
        pwm="its number",
        full="its greatest value",
        signed="true: from minus the greatest value on",
        safe="the value that is safe; 0 unless it says so",
    ),
    "number_out": named(
        number_out="its number",
        range="`least..greatest`",
        safe="the value that is safe; the one next to 0 unless it says so",
    ),
    "flag": named(flag="on or off at the start", host="true: the program of the board sets it"),
}
WIRES = {
    kind: rows
    if kind == "flag"
    else {**rows, **named(register="its place in a mapped window: at, access, shift, bits")}
    for kind, rows in WIRES.items()
}
"""The options of a signal, by the kind of it."""
REGISTER = named(
    at="bytes from the start of the window",
    access="8, 16 or 32: bits of the register; 32 unless it says so",
    shift="of its lowest bit in the register; 0 unless it says so",
    bits="how many bits it has there",
)
DEVICE = named(
    header="what the generated C includes",
    type="its type there; the functions have its name before theirs",
    reads="the signals that `type_sense` is given",
    writes="the signals that `type_act` writes",
    notices="what `type_sense` returns, as bits `TYPE_NAME`",
)
OFF = named(when="the condition", keep="outputs that keep their values then")
SOURCES = {
    "of": named(of="the signal", above="true beyond it", below="false under it"),
    "invalid": named(invalid="the signal", for_="for so long"),
    "call": named(call="`device.function`", with_="its arguments"),
    "when": named(when="a condition for each value", else_="the value otherwise"),
    "is": named(is_="the value", of="the signal"),
}
"""Where the value of an input comes from, where it is no expression; by its first key."""
TRIGGERS = named(
    rising="a condition that becomes true",
    falling="a condition that becomes false",
    changed="a signal that becomes another",
    while_="a condition under which it is posted; alone: in each cycle",
)
ACTIONS = named(call="`device.function`", with_="its arguments", set="signals and what they become")
BOARD = {
    **named(
        board="the node of the deployment that runs on it",
        doc="what it is for",
        deployment="the file of the deployment",
        period="the time from one cycle to the next",
        signals="its wires, and flags",
    ),
    "use": Key("use", "devices such as axis drives, written in C", Form.RECORDS, rows=DEVICE),
    **named(
        bind="the bindings of signals to the machines of the node",
        set="flags and outputs derived from others",
    ),
    "off": Key("off", "the condition for safe outputs", Form.RECORD, rows=OFF),
}
