"""The tables of IEC 61508-3:2010 and ISO 26262-6:2018, and the parts that support their rows.

Only rows that fsmkit can support are listed. A row names the technique, the part of the report,
and what the part contributes; a person decides whether that suffices.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Technique:
    """A row of a table. ``part``: the id of the section of the report that supports it."""

    table: str
    row: str
    name: str
    part: str
    how: str


MODEL, CHECK, MUTANTS = "model", "check", "mutants"
TESTS, CERTIFICATES, ANALYSES, REQUIREMENTS = "tests", "certificates", "analyses", "requirements"

IEC = (
    Technique("A.1", "1a", "Semi-formal methods", MODEL, "statecharts with a defined meaning"),
    Technique("A.1", "1b", "Formal methods", CHECK, "requirements as properties of all states"),
    Technique("A.1", "2, 3", "Forward and backward traceability", REQUIREMENTS, "the matrix"),
    Technique("A.2", "11b", "Semi-formal methods", MODEL, "statecharts, hierarchy, regions"),
    Technique("A.2", "11d", "Automatic software generation", CERTIFICATES,
              "the generated C is compared with the chart step by step"),
    Technique("A.2", "13c", "Event-driven, with guaranteed maximum response time", CERTIFICATES,
              "the most instructions of each event, without waiting times"),
    Technique("A.2", "14", "Static resource allocation", ANALYSES, "no allocation, no recursion"),
    Technique("A.3", "3", "Language subset", ANALYSES, "MISRA C:2012, deviations listed"),
    Technique("A.4", "1b", "Semi-formal methods", MODEL, "statecharts"),
    Technique("A.4", "8", "Forward traceability to the design", REQUIREMENTS,
              "items of charts by requirement"),
    Technique("A.5", "2", "Dynamic analysis and testing", TESTS, "test cases and their coverage"),
    Technique("A.5", "4", "Functional and black box testing", TESTS, "cases by requirement"),
    Technique("A.5", "6", "Model based testing", CERTIFICATES,
              "every reachable step of the model is a test of the code"),
    Technique("A.5", "9", "Forward traceability to tests", REQUIREMENTS, "tests by requirement"),
    Technique("A.5", "10", "Formal verification", CHECK, "exhaustive, on the generated C"),
    Technique("A.7", "3", "Modelling", MODEL, "finite state machines"),
    Technique("A.9", "1", "Formal proof", CHECK, "verdicts over all reachable states"),
    Technique("A.9", "3", "Static analysis", ANALYSES, "EVA and Cppcheck"),
    Technique("A.9", "4", "Dynamic analysis and testing", TESTS, "test cases and their coverage"),
    Technique("A.9", "5, 6", "Forward and backward traceability", REQUIREMENTS, "the matrix"),
    Technique("B.1", "2, 6", "No dynamic objects; limited use of recursion", ANALYSES,
              "MISRA rules 21.3 and 17.2 have no deviation"),
    Technique("B.2", "3", "Test case execution from error seeding", MUTANTS,
              "seeded mistakes that the properties find"),
    Technique("B.2", "6", "Equivalence classes and input partition testing", CERTIFICATES,
              "values of each class, with their bounds"),
    Technique("B.2", "7b-7d", "Structural test coverage", TESTS,
              "states, transitions, decisions, conditions (MC/DC) of the charts"),
    Technique("B.5", "2a", "Finite state machines", MODEL, "the charts"),
    Technique("B.6", "2", "Response timings and memory constraints", CERTIFICATES,
              "instructions and stack of each event"),
    Technique("B.7", "4a", "Finite state machines, state transition diagrams", MODEL,
              "the charts and their drawings"),
    Technique("B.8", "3, 4", "Control flow and data flow analysis", ANALYSES, "EVA, Cppcheck"),
    Technique("B.8", "9", "Static analysis of run-time error behaviour", ANALYSES, "EVA"),
)  # fmt: skip
"""Annex A and B of IEC 61508-3:2010."""

ISO = (
    Technique("1", "1b", "Use of language subsets", ANALYSES, "MISRA C:2012, deviations listed"),
    Technique("1", "1f", "Use of unambiguous graphical representation", MODEL, "drawn charts"),
    Technique("2", "1c", "Semi-formal notations", MODEL, "statecharts"),
    Technique("4", "1c", "Simulation of dynamic behaviour", TESTS, "test cases on the model"),
    Technique("4", "1e", "Formal verification", CHECK, "properties of the whole system"),
    Technique("5", "1c", "Semi-formal notations", MODEL, "statecharts"),
    Technique("6", "1b", "No dynamic objects or variables", ANALYSES, "no allocation"),
    Technique("6", "1c", "Initialization of variables", ANALYSES, "EVA: no uninitialized read"),
    Technique("6", "1j", "No recursions", ANALYSES, "MISRA rule 17.2 has no deviation"),
    Technique("7", "1d", "Semi-formal verification", CHECK, "exploration of the charts"),
    Technique("7", "1e", "Formal verification", CHECK, "exhaustive, on the generated C"),
    Technique("7", "1f, 1g", "Control flow and data flow analysis", ANALYSES, "EVA, Cppcheck"),
    Technique("7", "1h", "Static code analysis", ANALYSES, "Cppcheck with the MISRA addon"),
    Technique("7", "1i", "Static analyses based on abstract interpretation", ANALYSES, "EVA"),
    Technique("7", "1j", "Requirements-based test", REQUIREMENTS, "tests by requirement"),
    Technique("7", "1l", "Fault injection test", MUTANTS, "mistakes seeded into the charts"),
    Technique("7", "1m", "Resource usage evaluation", CERTIFICATES, "instructions and stack"),
    Technique("7", "1n", "Back-to-back comparison of model and code", CERTIFICATES,
              "interpreter, C and binary in every reachable step"),
    Technique("8", "1a", "Analysis of requirements", REQUIREMENTS, "tests by requirement"),
    Technique("8", "1b, 1c", "Equivalence classes and boundary values", CERTIFICATES,
              "values of each class, with their bounds"),
    Technique("9", "1b", "Branch coverage", TESTS, "transitions and outcomes of guards"),
    Technique("9", "1c", "MC/DC", TESTS, "conditions of guards"),
    Technique("10", "1a", "Requirements-based test", REQUIREMENTS, "tests by requirement"),
    Technique("10", "1e", "Back-to-back comparison of model and code", CERTIFICATES,
              "interpreter, C and binary in every reachable step"),
    Technique("10", "1h", "Static analyses based on abstract interpretation", ANALYSES, "EVA"),
)  # fmt: skip
"""Tables of methods of ISO 26262-6:2018."""
