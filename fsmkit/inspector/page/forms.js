"use strict";
// Forms made of types: a payload, an input.

/** Return a control for a value of a type, and how to read it. */
function field(type, value, label) {
  const start = value === undefined ? type.start : value;
  const named = { "aria-label": label };
  switch (type.kind) {
    case "bool": {
      const input = make("input", { type: "checkbox", ...named });
      input.checked = Boolean(start);
      return { node: input, read: () => input.checked, write: (v) => { input.checked = Boolean(v); } };
    }
    case "enum": {
      const select = make("select", named, ...type.members.map((name) => make("option", { value: name }, name)));
      select.value = start;
      return { node: select, read: () => select.value, write: (v) => { select.value = v; } };
    }
    case "int": {
      const input = make("input", { type: "number", step: "1", min: shown(type.lo), max: shown(type.hi), value: shown(start), title: `${shown(type.lo)} to ${shown(type.hi)}`, ...named });
      return { node: input, read: () => (Number.isSafeInteger(Number(input.value)) ? Number(input.value) : { int: input.value }), write: (v) => { input.value = shown(v); } };
    }
    case "float": {
      const input = make("input", { type: "text", inputmode: "decimal", value: shown(start), ...named });
      return { node: input, read: () => (Number.isFinite(Number(input.value)) ? Number(input.value) : { float: input.value }), write: (v) => { input.value = shown(v); } };
    }
    case "array":
      return composite(Array.from({ length: type.length }, (_, i) => [i, field(type.of, Array.isArray(start) ? start[i] : undefined, `${label} ${i}`)]), (parts) => parts.map(([, part]) => part.read()));
    case "record":
      return composite(type.fields.map((each) => [each.name, field(each.type, start ? start[each.name] : undefined, `${label} ${each.name}`)]), (parts) => Object.fromEntries(parts.map(([name, part]) => [name, part.read()])));
    case "duration": {
      const input = make("input", { type: "number", min: "0", value: shown(start), title: "ticks", ...named });
      return { node: input, read: () => Number(input.value), write: (v) => { input.value = shown(v); } };
    }
    default: {
      const input = make("input", { type: "text", value: shown(start), ...named });
      return { node: input, read: () => input.value, write: (v) => { input.value = shown(v); } };
    }
  }
}

function composite(parts, read) {
  const node = make("span", { class: "parts" }, ...parts.flatMap(([name, part]) => [make("small", {}, String(name)), part.node]));
  return { node, read: () => read(parts), write: (value) => { for (const [name, part] of parts) part.write(value[name]); } };
}
