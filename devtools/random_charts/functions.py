"""Random functions of a chart, valid by construction: each calls only those before it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from devtools.random_charts.choices import Choices
from devtools.random_charts.content import PLACE, Content, text
from devtools.random_charts.terms import LEVEL
from devtools.random_charts.vocabulary import Named, Names, Operation, is_machine, near
from fsmkit.language import BOOL, MACHINE_INTEGERS, ArrayType, Field, IntType, Type
from fsmkit.language.statements import tree as stmt

PARAMETERS: tuple[Type, ...] = (
    *(IntType(0, 9), BOOL, LEVEL, IntType(-5, 5), MACHINE_INTEGERS["uint8"]),
    *(IntType(0, 4000), MACHINE_INTEGERS["int64"]),
)
PERCENT = IntType(0, 100)


@dataclass(frozen=True, slots=True)
class Function:
    """A function with its body."""

    name: str
    parameters: tuple[Field, ...]
    result: Type
    body: stmt.Block


def random_functions(choices: Choices, names: Names) -> tuple[Function, ...]:
    """Return at least one function that may read `names`."""
    found: list[Function] = []
    for number in range(choices.integer(1, 4)):
        function = _function(choices, names, f"fn{number}")
        found.append(function)
        called = Operation(function.name, function.parameters, function.result)
        names = replace(names, functions=(*names.functions, called))
    return tuple(found)


def _function(choices: Choices, names: Names, name: str) -> Function:
    types = [choices.pick(PARAMETERS) for _ in range(choices.integer(0, 3))]
    arrays = [v.type for v in names.of(ArrayType)]
    if arrays and choices.chance(40):
        types.append(choices.pick(arrays))
    parameters = tuple(Field(f"{name}_{n}", type_) for n, type_ in enumerate(types))
    own = tuple(Named(p.name, p.type, writable=False) for p in parameters)
    read = tuple(replace(v, writable=False) for v in names.variables)
    content = Content(choices, replace(names, variables=(*own, *read)), ())
    if choices.chance(40):
        term = content.terms.integer(2)
        if not is_machine(term) and near(term.type):
            return Function(name, parameters, term.type, (stmt.Return(text(term.text), PLACE),))
    results: tuple[Type, ...] = (PERCENT, BOOL, LEVEL)
    result = choices.pick(results)
    return Function(name, parameters, result, _Body(content, result).block(2))


@dataclass(frozen=True, slots=True)
class _Body:
    """Makes the statements of one function."""

    content: Content
    result: Type

    def block(self, depth: int) -> stmt.Block:
        """Return statements that return on each path."""
        found: list[stmt.WrittenStatement] = []
        body = self
        for _ in range(body.content.choices.integer(0, 3)):
            if body.content.choices.chance(45):
                local, content = body.content.local()
                found.append(local)
                body = replace(body, content=content)
            else:
                found.append(body.step(depth))
        return (*found, *body.end(depth))

    def end(self, depth: int) -> stmt.Block:
        choices, terms = self.content.choices, self.content.terms
        if depth > 0 and choices.chance(30):
            then = stmt.Branch(text(terms.boolean(1)), self.block(depth - 1))
            return (stmt.If((then, stmt.Branch(None, self.block(depth - 1))), PLACE),)
        return (self.returned(),)

    def returned(self) -> stmt.WrittenStatement:
        terms = self.content.terms
        if self.result == PERCENT:
            return stmt.Return(text(f"Percent({terms.integer(2).text})"), PLACE)
        return stmt.Return(text(terms.value(self.result)), PLACE)

    def step(self, depth: int) -> stmt.WrittenStatement:
        """Return a statement that may return, or assigns a variable of the function."""
        choices, terms = self.content.choices, self.content.terms
        own = [v for v in self.content.names.variables if v.writable]
        kind = choices.integer(0, 3)
        if kind == 0 and own:
            target = choices.pick(own)
            return stmt.Assign(text(target.name), text(terms.value(target.type, 1)), PLACE)
        if kind == 1 and depth > 0:
            array, item, index, content = self.content.head()
            inner = replace(self, content=content).step(depth - 1)
            return stmt.ForEach(array, item, index, (inner,), PLACE)
        return stmt.If((stmt.Branch(text(terms.boolean(1)), (self.returned(),)),), PLACE)
