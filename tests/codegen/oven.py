"""A chart whose saved state has every kind of value, a queue, a timer and deferred events."""

OVEN = """
chart: Oven
types: {Heat: [low, high]}
events: {in: ["go(heat Heat, grams int16)", stop, hint]}
operations: [alarm]
data: {heat: Heat = Heat.low, grams: int16 = 0, factor: float64 = 0.1, rows: "uint8[3] = 7"}
initial: off
states:
  off: {on: {go: {target: on, do: "heat = event.heat; grams = event.grams; rows[1] = 9"}}}
  on:
    defer: [hint]
    initial: warm
    on: {stop: off}
    states:
      warm: {after: {5s: hot}}
      hot: {entry: alarm(), after: {1s: warm}}
"""
