"""The XML files of an FMU."""

from __future__ import annotations

from collections.abc import Sequence

from lxml import etree

from fsmkit.codegen.fmu.variables import Variable

TRIGGERED = {"IN", "OUT", "CALL"}
Items = tuple[tuple[str, int], ...]


def description(
    name: str, token: str, variables: Sequence[Variable], version: str, sources: Sequence[str]
) -> bytes:
    """Return ``modelDescription.xml``."""
    is_3 = version == "3.0"
    token_name = "instantiationToken" if is_3 else "guid"
    root = _element(None, "fmiModelDescription", fmiVersion=version, modelName=name)
    root.set(token_name, token)
    root.set("generationTool", "fsmkit")
    unit = _element(root, "CoSimulation", modelIdentifier=name,
                    canHandleVariableCommunicationStepSize="true")  # fmt: skip
    word = "State" if is_3 else "state"
    unit.set(f"canGetAndSetFMU{word}", "true")
    unit.set(f"canSerializeFMU{word}", "true")
    if is_3:
        unit.set("hasEventMode", "true")
    else:
        files = _element(unit, "SourceFiles")
        for source in sources:
            _element(files, "File", name=source)
    types: dict[Items, str] = {}
    for variable in variables:
        if variable.items and variable.items not in types:
            types[variable.items] = f"type_{len(types) + 1}"
    if types:
        _types(root, types, is_3=is_3)
    categories = _element(root, "LogCategories")
    _element(categories, "Category", name="logStatusError")
    _element(root, "DefaultExperiment", startTime="0", stopTime="10", stepSize="0.01")
    holder = _element(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        print_ = _variable_3 if is_3 else _variable_2
        print_(holder, variable, reference, types)
    structure = _element(root, "ModelStructure")
    outputs = [r for r, v in enumerate(variables) if v.causality == "output"]
    if is_3:
        for reference in outputs:
            _element(structure, "Output", valueReference=reference)
        for reference in outputs:
            if variables[reference].kind == "Clock":
                _element(structure, "InitialUnknown", valueReference=reference)
    elif outputs:
        listed = _element(structure, "Outputs")
        for reference in outputs:
            _element(listed, "Unknown", index=reference + 1)
    return _text(root)


def build_description(name: str, sources: Sequence[str]) -> bytes:
    """Return ``buildDescription.xml`` of FMI 3.0."""
    root = _element(None, "fmiBuildDescription", fmiVersion="3.0")
    unit = _element(root, "BuildConfiguration", modelIdentifier=name)
    files = _element(unit, "SourceFileSet", language="C99")
    for source in sources:
        _element(files, "SourceFile", name=source)
    return _text(root)


def _element(parent: etree._Element | None, tag: str, /, **attributes: object) -> etree._Element:
    texts = {name: str(value) for name, value in attributes.items()}
    if parent is None:
        return etree.Element(tag, texts)
    return etree.SubElement(parent, tag, texts)


def _text(root: etree._Element) -> bytes:
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _types(root: etree._Element, types: dict[Items, str], *, is_3: bool) -> None:
    holder = _element(root, "TypeDefinitions")
    for items, name in types.items():
        if is_3:
            inner = _element(holder, "EnumerationType", name=name)
        else:
            inner = _element(_element(holder, "SimpleType", name=name), "Enumeration")
        for text, value in items:
            _element(inner, "Item", name=text, value=value)


def _start(variable: Variable) -> str:
    if variable.kind == "Boolean":
        return str(bool(variable.start)).lower()
    if variable.kind.startswith("Float"):
        return repr(float(str(variable.start)))
    return str(variable.start)


def _bounds(variable: Variable) -> dict[str, str]:
    of = variable.bounds
    return {} if of is None else {"min": str(of[0]), "max": str(of[1])}


def _variable_3(
    holder: etree._Element, variable: Variable, reference: int, types: dict[Items, str]
) -> None:
    made = _element(holder, variable.kind, name=variable.name, valueReference=reference)
    made.set("causality", variable.causality)
    if variable.source == "TIME":
        made.set("variability", "continuous")
        return
    if variable.kind == "Clock":
        is_triggered = variable.source in TRIGGERED
        made.set("intervalVariability", "triggered" if is_triggered else "countdown")
        return
    made.set("variability", "discrete")
    if variable.causality != "input":
        made.set("initial", "exact")
    if variable.clock is not None:
        made.set("clocks", str(variable.clock))
    if variable.items:
        made.set("declaredType", types[variable.items])
    for name, value in _bounds(variable).items():
        made.set(name, value)
    made.set("start", _start(variable))


def _variable_2(
    holder: etree._Element, variable: Variable, reference: int, types: dict[Items, str]
) -> None:
    outer = _element(holder, "ScalarVariable", name=variable.name, valueReference=reference)
    outer.set("causality", variable.causality)
    made = _element(outer, variable.kind2)
    if variable.source == "TIME":
        outer.set("variability", "continuous")
        return
    outer.set("variability", "discrete")
    if variable.causality != "input":
        outer.set("initial", "exact")
    if variable.items:
        made.set("declaredType", types[variable.items])
    if variable.kind == "Clock":
        made.set("min", "0")
    for name, value in _bounds(variable).items():
        made.set(name, value)
    made.set("start", _start(variable))
